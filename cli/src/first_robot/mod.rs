//! The pictures of `docs/first-robot.md`: how doubt grows while a robot drives, and how a wheel looks that is off.
//!
//! A test draws them anew and holds them against the files, so what is shown is what the estimator does.

mod cloud;
mod dead_reckoning;
mod wheels;

use std::path::{Path, PathBuf};

use clap::Args;

use crate::output::{complain, print_line};
use crate::pictures::{EllipsePanel, check_fonts, draw_ellipses, to_png};
use crate::result_file::WriteError;
use crate::status::Status;

/// Draws the pictures of docs/first-robot.md.
#[derive(Clone, Debug, Args)]
pub(crate) struct FirstRobotArgs {
    /// The folder that gets them, as SVG
    folder: PathBuf,
    /// Draw them as PNG too
    #[arg(long)]
    png: bool,
}

/// File, caption, and what is in it.
type Picture = (&'static str, &'static str, fn() -> Vec<EllipsePanel>);

const PICTURES: [Picture; 2] = [
    (
        "wheels.svg",
        "A wheel that is off is no noise: where the wheels say the robot is, and the 95 % ellipse of honest ones",
        wheels::panels,
    ),
    (
        "dead-reckoning.svg",
        "90 s straight on without a fix, 1 m/s: where 300 robots are, and the 95 % ellipses of two filters",
        dead_reckoning::panels,
    ),
];

/// The whole command.
pub(crate) fn command(args: &FirstRobotArgs) -> Status {
    if let Some(why) = args.png.then(check_fonts).and_then(Result::err) {
        complain(&format!("coloc: {why}"));
        return Status::Failed;
    }
    for picture in PICTURES {
        match draw(&args.folder, picture, args.png) {
            Ok(file) => print_line(&format!("{}", file.display())),
            Err(error) => {
                complain(&format!("coloc: {error}"));
                return Status::Failed;
            }
        }
    }
    Status::Done
}

fn draw(folder: &Path, (name, caption, panels): Picture, png: bool) -> Result<PathBuf, WriteError> {
    let file = folder.join(name);
    draw_ellipses(&file, caption, &panels())?;
    if png {
        to_png(&file)?;
    }
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Small enough for a document, and as the program draws them today.
    #[test]
    fn the_documents_pictures_are_these() {
        let folder = tempfile::tempdir().unwrap();
        let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/first-robot");
        for picture in PICTURES {
            let drawn = std::fs::read(draw(folder.path(), picture, false).unwrap()).unwrap();
            assert!(drawn.len() < 60_000, "{}: {} bytes", picture.0, drawn.len());
            let there = std::fs::read(kept.join(picture.0)).unwrap_or_default();
            assert!(
                drawn == there,
                "{} is another picture: coloc first-robot docs/first-robot",
                picture.0
            );
        }
    }
}
