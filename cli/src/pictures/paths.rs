//! Where the robots were and where they said they were.

use std::path::Path;

use plotters::prelude::*;

use super::PictureError;
use super::style::{GRID, INK, TRUTH, extent, line, robot_color, thinned, tick_label};
use crate::comparison::Comparison;

/// One robot's line in the picture.
pub(crate) struct RobotPath<'a> {
    /// As the legend calls it.
    pub(crate) name: &'a str,
    /// Estimates beside the truth, in the order of their stamps.
    pub(crate) comparisons: &'a [Comparison],
}

const WIDTH_PX: u32 = 1000;
const CAPTION_PX: u32 = 40;
const MARGIN_PX: u32 = 15;
const LABELS_PX: u32 = 50;
const MOST_POINTS: usize = 3000;

/// Draws truth and estimate of every robot in the common frame, a metre as long on both axes.
pub(crate) fn draw_paths(
    file: &Path,
    caption: &str,
    robots: &[RobotPath<'_>],
) -> Result<(), PictureError> {
    let window = Window::around(robots);
    let size = (WIDTH_PX, window.height_px());
    let area = SVGBackend::new(file, size).into_drawing_area();
    draw(&area, caption, robots, &window).map_err(|error| PictureError::new(file, &error))
}

/// The part of the plane that is shown \[m\].
struct Window {
    x: (f64, f64),
    y: (f64, f64),
}

impl Window {
    /// All paths with 5 % of air around them.
    fn around(robots: &[RobotPath<'_>]) -> Self {
        let poses = || {
            robots
                .iter()
                .flat_map(|robot| robot.comparisons)
                .flat_map(|c| [c.truth, c.estimate])
        };
        let (x, y) = (extent(poses().map(|p| p.x)), extent(poses().map(|p| p.y)));
        let air = 0.05 * (x.1 - x.0).max(y.1 - y.0).max(0.2);
        let mut window = Self {
            x: (x.0 - air, x.1 + air),
            y: (y.0 - air, y.1 + air),
        };
        window.widen_to_half_as_high();
        window
    }

    /// A window much taller than wide would make a picture of several screens.
    fn widen_to_half_as_high(&mut self) {
        let missing = (self.y.1 - self.y.0) - (self.x.1 - self.x.0);
        if missing > 0.0 {
            self.x = (self.x.0 - missing / 2.0, self.x.1 + missing / 2.0);
        }
        let missing = 0.4 * (self.x.1 - self.x.0) - (self.y.1 - self.y.0);
        if missing > 0.0 {
            self.y = (self.y.0 - missing / 2.0, self.y.1 + missing / 2.0);
        }
    }

    /// Picture height that makes a metre equally long on both axes.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Between 40 % and 100 % of the width.
    fn height_px(&self) -> u32 {
        let plot_width = f64::from(WIDTH_PX - 2 * MARGIN_PX - LABELS_PX);
        let plot_height = plot_width * (self.y.1 - self.y.0) / (self.x.1 - self.x.0);
        plot_height.round() as u32 + 2 * MARGIN_PX + LABELS_PX + CAPTION_PX
    }
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn draw(
    area: &Area<'_>,
    caption: &str,
    robots: &[RobotPath<'_>],
    window: &Window,
) -> Result<(), Box<dyn std::error::Error>> {
    area.fill(&WHITE)?;
    let (title, plot) = area.split_vertically(CAPTION_PX);
    title.draw(&Text::new(
        caption.to_owned(),
        (10, 12),
        ("sans-serif", 20).into_font().color(&INK),
    ))?;
    let mut chart = ChartBuilder::on(&plot)
        .margin(MARGIN_PX)
        .x_label_area_size(LABELS_PX)
        .y_label_area_size(LABELS_PX)
        .build_cartesian_2d(window.x.0..window.x.1, window.y.0..window.y.1)?;
    chart
        .configure_mesh()
        .x_desc("x [m]")
        .y_desc("y [m]")
        .label_style(("sans-serif", 14).into_font().color(&INK))
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(INK)
        .x_label_formatter(&tick_label)
        .y_label_formatter(&tick_label)
        .draw()?;
    for (index, robot) in robots.iter().enumerate() {
        let truth = thinned(robot.comparisons, MOST_POINTS).map(|c| (c.truth.x, c.truth.y));
        let drawn = chart.draw_series(LineSeries::new(truth, line(TRUTH, 5)))?;
        if index == 0 {
            drawn
                .label("truth")
                .legend(|(x, y)| PathElement::new([(x, y), (x + 20, y)], line(TRUTH, 5)));
        }
    }
    for (index, robot) in robots.iter().enumerate() {
        let style = line(robot_color(index), 2);
        let estimate =
            thinned(robot.comparisons, MOST_POINTS).map(|c| (c.estimate.x, c.estimate.y));
        chart
            .draw_series(LineSeries::new(estimate, style))?
            .label(format!("{}, estimate", robot.name))
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], style));
        let start = robot.comparisons.first().map(|c| (c.truth.x, c.truth.y));
        chart.draw_series(start.map(|at| Circle::new(at, 5, robot_color(index).filled())))?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .border_style(GRID)
        .label_font(("sans-serif", 14).into_font().color(&INK))
        .draw()?;
    area.present()?;
    Ok(())
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
                comparisons: &one,
            },
            RobotPath {
                name: "robot 2",
                comparisons: &two,
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
            3,
            "two truths and their legend entry"
        );
    }

    #[test]
    fn a_metre_is_as_long_on_both_axes() {
        let comparisons = circle(1.0);
        let window = Window::around(&[RobotPath {
            name: "",
            comparisons: &comparisons,
        }]);
        let across = f64::from(WIDTH_PX - 2 * MARGIN_PX - LABELS_PX) / (window.x.1 - window.x.0);
        let up = f64::from(window.height_px() - 2 * MARGIN_PX - LABELS_PX - CAPTION_PX)
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
                comparisons: &[],
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
