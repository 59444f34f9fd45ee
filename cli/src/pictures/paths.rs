//! Where the robots were and where they said they were.

use std::path::Path;

use plotters::prelude::*;

use super::legend::Legend;
use super::style::{INK, TRUTH, line, robot_color, thinned};
use super::window::{LABELS_PX, MARGIN_PX, Window};
use super::{Area, Failure, write_svg};
use crate::comparison::Comparison;
use crate::result_file::WriteError;

/// One robot's line in the picture.
pub(crate) struct RobotPath<'a> {
    /// As the legend calls it.
    pub(crate) name: &'a str,
    /// Estimates beside the truth, in the order of their stamps. Between the pieces there is a gap.
    pub(crate) pieces: Vec<&'a [Comparison]>,
}

const WIDTH_PX: u32 = 1000;
const CAPTION_PX: u32 = 40;
const BESIDE_PX: u32 = 2 * MARGIN_PX + LABELS_PX;
const MOST_POINTS: usize = 3000;

/// Draws truth and estimate of every robot in the common frame, a metre as long on both axes.
pub(crate) fn draw_paths(
    file: &Path,
    caption: &str,
    robots: &[RobotPath<'_>],
) -> Result<(), WriteError> {
    let (window, legend) = (window(robots), legend(robots));
    let legend_px = legend.height_px(WIDTH_PX);
    let size = (
        WIDTH_PX,
        CAPTION_PX + legend_px + window.height_px(WIDTH_PX, BESIDE_PX),
    );
    write_svg(file, size, |area| {
        area.fill(&WHITE)?;
        let (title, rest) = area.split_vertically(CAPTION_PX);
        draw_title(&title, caption)?;
        let (keys, plot) = rest.split_vertically(legend_px);
        legend.draw(&keys)?;
        draw_plot(&plot, robots, &window)
    })
}

fn legend(robots: &[RobotPath<'_>]) -> Legend {
    let robot = |(index, robot): (usize, &RobotPath<'_>)| {
        let name = format!("{}, estimate", robot.name);
        (name, line(robot_color(index), 2))
    };
    let truth = ("truth".to_owned(), line(TRUTH, 5));
    let estimates = robots.iter().enumerate().map(robot);
    Legend::new(std::iter::once(truth).chain(estimates).collect())
}

/// All paths.
fn window(robots: &[RobotPath<'_>]) -> Window {
    let poses = robots
        .iter()
        .flat_map(|robot| robot.pieces.iter().copied().flatten())
        .flat_map(|c| [c.truth, c.estimate]);
    Window::around(poses.map(|pose| (pose.x, pose.y)))
}

fn draw_title(area: &Area<'_>, caption: &str) -> Result<(), Failure> {
    let font = ("sans-serif", 20).into_font().color(&INK);
    area.draw(&Text::new(caption.to_owned(), (10, 12), font))?;
    Ok(())
}

fn draw_plot(plot: &Area<'_>, robots: &[RobotPath<'_>], window: &Window) -> Result<(), Failure> {
    let mut chart = window.chart(plot)?;
    for robot in robots {
        chart.draw_series(lines(robot, |c| (c.truth.x, c.truth.y), line(TRUTH, 5)))?;
    }
    for (index, robot) in robots.iter().enumerate() {
        let color = robot_color(index);
        let estimate = lines(robot, |c| (c.estimate.x, c.estimate.y), line(color, 2));
        chart.draw_series(estimate)?;
        let start = robot.pieces.iter().copied().flatten().next();
        let start = start.map(|c| (c.truth.x, c.truth.y));
        chart.draw_series(start.map(|at| Circle::new(at, 5, color.filled())))?;
        // Colours start over after ten robots; names do not.
        let font = ("sans-serif", 13).into_font().color(&INK);
        chart.draw_series(
            start.map(|at| EmptyElement::at(at) + Text::new(robot.name.to_owned(), (7, -14), font)),
        )?;
    }
    Ok(())
}

fn lines(
    robot: &RobotPath<'_>,
    place: fn(&Comparison) -> (f64, f64),
    style: ShapeStyle,
) -> Vec<PathElement<(f64, f64)>> {
    thinned(&robot.pieces, MOST_POINTS)
        .map(|piece| PathElement::new(piece.map(place).collect::<Vec<_>>(), style))
        .collect()
}

#[cfg(test)]
mod tests {
    use coloc_estimator::Pose;

    use super::*;

    fn circle(turns: f64) -> Vec<Comparison> {
        (0..200)
            .map(|k| {
                let angle = turns * f64::from(k) / 200.0 * std::f64::consts::TAU;
                let truth = Pose::new(3.0 * angle.cos(), 2.0 * angle.sin(), angle);
                let estimate = Pose {
                    x: truth.x + 0.05,
                    ..truth
                };
                Comparison {
                    time_s: f64::from(k) * 0.02,
                    truth,
                    estimate,
                    sigma: [0.1; 3],
                }
            })
            .collect()
    }

    #[test]
    fn names_units_and_every_robot_are_in_the_picture() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("paths.svg");
        let (one, two) = (circle(1.0), circle(0.5));
        let robots = [
            RobotPath {
                name: "robot 1",
                pieces: vec![&one],
            },
            RobotPath {
                name: "robot 2",
                pieces: vec![&two[..100], &two[120..]],
            },
        ];
        draw_paths(&file, "Paths", &robots).unwrap();
        let svg = std::fs::read_to_string(&file).unwrap();
        for text in [
            "x [m]",
            "y [m]",
            "truth",
            "robot 1, estimate",
            "robot 2, estimate",
            "Paths",
        ] {
            assert!(svg.contains(text), "{text} is missing");
        }
        assert_eq!(
            svg.matches("stroke-width=\"5\"").count(),
            4,
            "three pieces of the truth and the legend's"
        );
    }

    #[test]
    fn a_metre_is_as_long_on_both_axes() {
        let comparisons = circle(1.0);
        let window = window(&[RobotPath {
            name: "",
            pieces: vec![&comparisons],
        }]);
        let across = f64::from(WIDTH_PX - BESIDE_PX) / (window.x.1 - window.x.0);
        let up = f64::from(window.height_px(WIDTH_PX, BESIDE_PX) - BESIDE_PX)
            / (window.y.1 - window.y.0);
        assert!((across / up - 1.0).abs() < 0.01);
    }

    #[test]
    fn a_robot_that_never_spoke_does_not_spoil_the_picture() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("paths.svg");
        draw_paths(
            &file,
            "Paths",
            &[RobotPath {
                name: "robot 1",
                pieces: Vec::new(),
            }],
        )
        .unwrap();
        assert!(std::fs::metadata(&file).unwrap().len() > 500);
    }

    #[test]
    fn a_folder_that_is_not_there_is_an_error_that_names_the_file() {
        let missing = Path::new("/nonexistent/paths.svg");
        let error = draw_paths(missing, "Paths", &[]).unwrap_err();
        assert!(error.to_string().contains("/nonexistent/paths.svg"));
    }
}
