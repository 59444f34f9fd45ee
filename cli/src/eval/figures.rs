//! The pictures of an evaluation.
//!
//! | file | shows | in the paper |
//! | --- | --- | --- |
//! | `errors-RN.svg` | mean error over runs of the first and the last robot, and ±3σ | figures 2, 3 |
//! | `methods.svg` | RMSE of every method and robot | figure 4 |
//! | `against-ccl.svg` | RMSE over time of the last robot, split-ci and coloc against the centralized filter | figure 5 |
//! | `conversion.svg` | covariance of a converted sighting against Monte-Carlo | figure 10 |
//! | `paths.svg` | estimated paths of the first run over the truth | |
//! | `nees.svg` | NEES over time of the first and the last robot, with its 95 % band | |

use std::path::{Path, PathBuf};

use coloc_estimator::Pose;
use coloc_sim::evaluate::{EvalReport, MethodReport, RobotReport};
use coloc_sim::method::Kind;
use plotters::style::RGBColor;

use super::conversion;
use crate::comparison::Comparison;
use crate::pictures::{
    BarPanel, ErrorPoint, Line, Panel, RobotPath, Scale, draw_bars, draw_ellipses, draw_errors,
    draw_lines, draw_paths, method_color, to_png,
};
use crate::result_file::WriteError;

type Name<'a> = &'a dyn Fn(usize) -> String;

/// Draws everything that the report has the methods for into `folder`.
pub(crate) fn draw(
    folder: &Path,
    png: bool,
    world: &str,
    report: &EvalReport,
    name: Name<'_>,
) -> Result<(), WriteError> {
    let artist = Artist {
        folder,
        setting: format!("{world}, {}, {} runs", report.scenario.name, report.runs),
        report,
        name,
    };
    let mut files = vec![artist.methods()?, artist.nees()?, artist.conversion()?];
    files.extend(artist.errors()?);
    files.extend(artist.against_ccl()?);
    files.extend(artist.paths()?);
    if png {
        files.iter().try_for_each(|file| to_png(file))?;
    }
    Ok(())
}

struct Artist<'a> {
    folder: &'a Path,
    setting: String,
    report: &'a EvalReport,
    name: Name<'a>,
}

impl Artist<'_> {
    fn file(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    fn method(&self, kind: Kind) -> Option<&MethodReport> {
        self.report
            .methods
            .iter()
            .find(|method| method.method == kind)
    }

    /// The product, or what was asked for first.
    fn main_method(&self) -> Option<&MethodReport> {
        self.method(Kind::Coloc).or(self.report.methods.first())
    }

    fn first_and_last(&self) -> Vec<usize> {
        let mut robots = vec![0, self.report.robots.saturating_sub(1)];
        robots.dedup();
        robots
    }

    fn methods(&self) -> Result<PathBuf, WriteError> {
        let file = self.file("methods.svg");
        let methods = &self.report.methods;
        let legend: Vec<_> = methods
            .iter()
            .map(|method| (method.method.name(), method_color(method.method)))
            .collect();
        let groups: Vec<String> = (0..self.report.robots).map(self.name).collect();
        let panel = |(i, (y_axis, unit)): (usize, (&'static str, f64))| BarPanel {
            y_axis,
            heights: methods
                .iter()
                .map(|method| {
                    method
                        .robots
                        .iter()
                        .map(|robot| unit * robot.rmse_mean[i])
                        .collect()
                })
                .collect(),
        };
        let axes = [
            ("x RMSE [cm]", 100.0),
            ("y RMSE [cm]", 100.0),
            ("heading RMSE [rad]", 1.0),
        ];
        let panels: Vec<BarPanel> = axes.into_iter().enumerate().map(panel).collect();
        let caption = format!("RMSE over runs, mean over time ({})", self.setting);
        draw_bars(&file, &caption, &groups, &legend, &panels)?;
        Ok(file)
    }

    fn nees(&self) -> Result<PathBuf, WriteError> {
        let file = self.file("nees.svg");
        let wanted = [Kind::Nb, Kind::Ccl, Kind::SplitCi, Kind::Coloc];
        let mut shown: Vec<_> = wanted
            .into_iter()
            .filter_map(|kind| self.method(kind))
            .collect();
        if shown.is_empty() {
            shown = self.report.methods.iter().collect();
        }
        let line = |method: &MethodReport, robot: usize| Line {
            label: method.method.name().into(),
            color: method_color(method.method),
            points: over_time(&method.robots[robot], |series| series.nees.clone()),
        };
        let panel = |robot| Panel {
            y_axis: format!("NEES of {}", (self.name)(robot)),
            scale: Scale::Logarithmic,
            band: Some((self.report.nees_band, "95 % band")),
            lines: shown.iter().map(|method| line(method, robot)).collect(),
        };
        let panels: Vec<Panel<'_>> = self.first_and_last().into_iter().map(panel).collect();
        let caption = format!("NEES, mean over runs; nominal 3 ({})", self.setting);
        draw_lines(&file, &caption, &panels)?;
        Ok(file)
    }

    fn errors(&self) -> Result<Vec<PathBuf>, WriteError> {
        let Some(method) = self.main_method() else {
            return Ok(Vec::new());
        };
        let draw = |robot| {
            let name = (self.name)(robot);
            let file = self.file(&format!("errors-{name}.svg"));
            let caption = format!(
                "{name}, {}: mean error over runs, and ±3σ ({})",
                method.method.name(),
                self.setting
            );
            draw_errors(&file, &caption, robot, &mean_errors(&method.robots[robot]))?;
            Ok(file)
        };
        self.first_and_last().into_iter().map(draw).collect()
    }

    fn against_ccl(&self) -> Result<Option<PathBuf>, WriteError> {
        let Some(central) = self.method(Kind::Ccl) else {
            return Ok(None);
        };
        let others = [Kind::SplitCi, Kind::Coloc]
            .into_iter()
            .filter_map(|kind| self.method(kind));
        let methods: Vec<_> = others.chain([central]).collect();
        let robot = self.report.robots.saturating_sub(1);
        let panel = |(i, (axis, unit)): (usize, (&str, f64))| Panel {
            y_axis: axis.into(),
            scale: Scale::Linear,
            band: None,
            lines: methods
                .iter()
                .map(|method| Line {
                    label: method.method.name().into(),
                    color: method_color(method.method),
                    points: over_time(&method.robots[robot], |series| {
                        series
                            .rmse
                            .iter()
                            .map(|rmse| rmse.map(|rmse| unit * rmse[i]))
                            .collect()
                    }),
                })
                .collect(),
        };
        let axes = [
            ("x RMSE [cm]", 100.0),
            ("y RMSE [cm]", 100.0),
            ("heading RMSE [rad]", 1.0),
        ];
        let panels: Vec<Panel<'_>> = axes.into_iter().enumerate().map(panel).collect();
        let file = self.file("against-ccl.svg");
        let caption = format!(
            "{}: decentralized against centralized, RMSE over runs ({})",
            (self.name)(robot),
            self.setting
        );
        draw_lines(&file, &caption, &panels)?;
        Ok(Some(file))
    }

    fn paths(&self) -> Result<Option<PathBuf>, WriteError> {
        let Some(method) = self.main_method() else {
            return Ok(None);
        };
        let names: Vec<String> = (0..self.report.robots).map(self.name).collect();
        let comparisons: Vec<_> = (0..self.report.robots)
            .map(|robot| first_run(self.report, method, robot))
            .collect();
        let robots: Vec<RobotPath<'_>> = names
            .iter()
            .zip(&comparisons)
            .map(|(name, pieces)| RobotPath {
                name,
                pieces: pieces.iter().map(Vec::as_slice).collect(),
            })
            .collect();
        let file = self.file("paths.svg");
        let caption = format!(
            "{} over the truth, first run ({})",
            method.method.name(),
            self.setting
        );
        draw_paths(&file, &caption, &robots)?;
        Ok(Some(file))
    }

    fn conversion(&self) -> Result<PathBuf, WriteError> {
        let file = self.file("conversion.svg");
        let caption = "A sighting converted into the common frame: 95 % ellipses of its position";
        let colors = [
            method_color(Kind::Ccl),
            method_color(Kind::SplitCi),
            method_color(Kind::Coloc),
        ];
        draw_ellipses(&file, caption, &conversion::panels(colors))?;
        Ok(file)
    }
}

fn over_time(
    robot: &RobotReport,
    values: impl Fn(&coloc_sim::evaluate::Series) -> Vec<Option<f64>>,
) -> Vec<(f64, Option<f64>)> {
    let times = robot.series.time_s.iter().copied();
    times.zip(values(&robot.series)).collect()
}

/// Pieces between which nobody knows the truth.
fn mean_errors(robot: &RobotReport) -> Vec<Vec<ErrorPoint>> {
    let series = &robot.series;
    let points = series
        .time_s
        .iter()
        .zip(series.mean_error.iter().zip(&series.three_sigma));
    pieces(points.map(|(&time_s, (error, bound))| {
        Some(ErrorPoint {
            time_s,
            error: (*error)?,
            three_sigma: (*bound)?,
            knows: true,
        })
    }))
}

/// Pieces between which nobody knows the truth.
fn first_run(report: &EvalReport, method: &MethodReport, robot: usize) -> Vec<Vec<Comparison>> {
    let series = &method.robots[robot].series;
    let truth = report
        .truth
        .get(robot)
        .map(|path| path.pose.as_slice())
        .unwrap_or_default();
    let points = series
        .time_s
        .iter()
        .zip(truth.iter().zip(&series.first_run_error));
    pieces(points.map(|(&time_s, (truth, error))| {
        let ([x, y, phi], [dx, dy, dphi]) = ((*truth)?, (*error)?);
        Some(Comparison {
            time_s,
            truth: Pose::new(x, y, phi),
            estimate: Pose::new(x + dx, y + dy, phi + dphi),
            sigma: [0.0; 3],
        })
    }))
}

/// What is there, cut where nothing is.
fn pieces<T: Copy>(points: impl Iterator<Item = Option<T>>) -> Vec<Vec<T>> {
    let points: Vec<Option<T>> = points.collect();
    points
        .split(Option::is_none)
        .map(|piece| piece.iter().copied().flatten().collect::<Vec<T>>())
        .filter(|piece| !piece.is_empty())
        .collect()
}

/// A colour for each role: draws' own ellipse, linearised, cubature.
pub(super) type Colors = [RGBColor; 3];

#[cfg(test)]
mod tests {
    use super::pieces;

    #[test]
    fn what_nobody_knows_is_a_gap() {
        let points = [None, Some(1), Some(2), None, None, Some(3)];
        assert_eq!(pieces(points.into_iter()), [vec![1, 2], vec![3]]);
    }
}
