//! The evaluation as pictures: the mean error over runs inside of its ±3σ, as the paper's figures 2 and 3 show it.

use std::path::Path;

use coloc_sim::evaluate::{EvalReport, Series};

use crate::pictures::{ErrorPoint, PictureError, draw_errors};

/// Draws a picture for every method and robot, and says how many.
pub(crate) fn draw(folder: &Path, report: &EvalReport) -> Result<usize, PictureError> {
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
