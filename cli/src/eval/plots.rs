//! The evaluation as pictures: the mean error over runs inside of its ±3σ, as the paper's figures 2 and 3 show it, and the
//! methods' NEES side by side.

use std::path::Path;

use coloc_sim::evaluate::{EvalReport, MethodReport, Series};

use crate::pictures::{ErrorPoint, NeesCurve, PictureError, draw_errors, draw_nees};

/// Draws the errors of every method and robot, and the NEES of every robot; says how many pictures that are.
pub(crate) fn draw(folder: &Path, report: &EvalReport) -> Result<usize, PictureError> {
    Ok(draw_all_errors(folder, report)? + draw_all_nees(folder, report)?)
}

fn draw_all_nees(folder: &Path, report: &EvalReport) -> Result<usize, PictureError> {
    for robot in 0..report.robots {
        let curve = |method: &MethodReport| {
            let series = &method.robots.get(robot)?.series;
            let known = series
                .time_s
                .iter()
                .zip(&series.nees)
                .filter_map(|(time_s, nees)| Some((*time_s, (*nees)?)));
            Some(NeesCurve {
                name: method.method.name(),
                points: known.collect(),
            })
        };
        let curves: Vec<_> = report.methods.iter().filter_map(curve).collect();
        let file = folder.join(format!("nees-R{}.svg", robot + 1));
        let caption = format!(
            "R{}: NEES, mean of {} runs ({})",
            robot + 1,
            report.runs,
            report.scenario.name
        );
        draw_nees(&file, &caption, report.nees_band, &curves)?;
    }
    Ok(report.robots)
}

fn draw_all_errors(folder: &Path, report: &EvalReport) -> Result<usize, PictureError> {
    let mut count = 0;
    for method in &report.methods {
        for (robot, figures) in method.robots.iter().enumerate() {
            let name = method.method.name();
            let file = folder.join(format!("errors-{name}-R{}.svg", robot + 1));
            let caption = format!(
                "{name}, R{}: mean error of {} runs inside of ±3σ ({})",
                robot + 1,
                report.runs,
                report.scenario.name
            );
            draw_errors(&file, &caption, robot, &points(&figures.series))?;
            count += 1;
        }
    }
    Ok(count)
}

/// Moments at which nobody knows the truth are left out.
fn points(series: &Series) -> Vec<ErrorPoint> {
    let bounds = series.mean_error.iter().zip(&series.three_sigma);
    let known = series
        .time_s
        .iter()
        .zip(bounds)
        .filter_map(|(time_s, (error, three_sigma))| {
            Some(ErrorPoint {
                time_s: *time_s,
                error: (*error)?,
                three_sigma: (*three_sigma)?,
            })
        });
    known.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_without_truth_are_left_out() {
        let known = Some([0.1; 3]);
        let series = Series {
            time_s: vec![0.0, 1.0, 2.0],
            mean_error: vec![known, None, known],
            three_sigma: vec![known, None, known],
            ..Series::default()
        };
        let times: Vec<f64> = points(&series).iter().map(|point| point.time_s).collect();
        assert_eq!(times, [0.0, 2.0]);
    }
}
