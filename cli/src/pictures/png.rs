//! PNG beside SVG. Unlike SVG it needs the machine's fonts.

use std::path::Path;

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};

use crate::result_file::{self, WriteError};

/// Common faces, in the order of preference; without any of them the first of the machine's is taken.
const FACES: [&str; 5] = [
    "DejaVu Sans",
    "Liberation Sans",
    "Noto Sans",
    "Arial",
    "Helvetica",
];

/// What is missing for it, if anything is.
pub(crate) fn check_fonts() -> Result<(), &'static str> {
    options().map(drop)
}

/// Writes the picture `svg` once more, ending in `.png`.
pub(crate) fn to_png(svg: &Path) -> Result<(), WriteError> {
    let file = svg.with_extension("png");
    let pixels = render(svg).map_err(|reason| WriteError::new(&file, &reason))?;
    result_file::write(&file, &pixels)
}

fn render(svg: &Path) -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    let tree = Tree::from_data(&std::fs::read(svg)?, &options()?)?;
    let size = tree.size().to_int_size();
    let mut pixels = Pixmap::new(size.width(), size.height()).ok_or("it has no size")?;
    resvg::render(&tree, Transform::identity(), &mut pixels.as_mut());
    Ok(pixels.encode_png()?)
}

fn options() -> Result<Options<'static>, &'static str> {
    let mut options = Options::default();
    let fonts = options.fontdb_mut();
    fonts.load_system_fonts();
    let named = |face: &str| {
        fonts
            .faces()
            .any(|known| known.families.iter().any(|(name, _)| name == face))
    };
    let any = || Some(fonts.faces().next()?.families.first()?.0.clone());
    let face = FACES
        .into_iter()
        .find(|face| named(face))
        .map(str::to_owned)
        .or_else(any)
        .ok_or(
            "this machine has no fonts: install some (fonts-dejavu-core), or leave --png away",
        )?;
    fonts.set_sans_serif_family(face.clone());
    options.font_family = face;
    Ok(options)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_has_the_size_of_its_svg() {
        let folder = tempfile::tempdir().unwrap();
        let svg = folder.path().join("a.svg");
        std::fs::write(
            &svg,
            "<svg xmlns='http://www.w3.org/2000/svg' width='30' height='20'/>",
        )
        .unwrap();
        match to_png(&svg) {
            Ok(()) => {
                let png = Pixmap::load_png(svg.with_extension("png")).unwrap();
                assert_eq!((png.width(), png.height()), (30, 20));
            }
            Err(error) => assert!(error.to_string().contains("no fonts"), "{error}"),
        }
    }
}
