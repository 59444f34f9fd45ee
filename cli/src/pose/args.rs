//! The command line of `coloc pose`.

use clap::Args;
use coloc_shm_types::RobotName;

use crate::place::PlaceArgs;

/// What a person sees without measuring \[m, m, rad\].
const SIGMA: [f64; 3] = [0.5, 0.5, 0.2];

/// Tells a robot whose daemon runs on this computer where it is, and waits until it believes it.
///
/// It is believed from the moment of the command on, whatever was believed before. It is right at that one moment: receivers and
/// neighbours that go on saying something else win.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  coloc pose robot1 12.5 -3 1.57
  coloc pose robot1 12.5 -3 90 --degrees
  coloc pose robot1 12.5 -3 90 --sigma 0.1 0.1 5 --degrees

Exit status: 0 the robot believes it; 1 it does not run, has refused it or does not believe it, 2 the arguments were not \
understood, 130 it was interrupted (128 + the signal's number), 141 the reader of standard output went away.")]
pub(crate) struct PoseArgs {
    /// Its name; `coloc list` shows who runs
    pub(crate) robot: RobotName,
    /// Metres, in the frame that all robots share
    #[arg(value_parser = number, allow_negative_numbers = true)]
    x: f64,
    /// Likewise
    #[arg(value_parser = number, allow_negative_numbers = true)]
    y: f64,
    /// Where it looks: radians, counterclockwise from the x axis
    #[arg(value_parser = number, allow_negative_numbers = true)]
    heading: f64,
    /// How far off each of the three may be, as one standard deviation [default: 0.5 m, 0.5 m, 0.2 rad]
    #[arg(long, num_args = 3, value_names = ["X", "Y", "HEADING"], value_parser = deviation, allow_negative_numbers = true)]
    sigma: Option<Vec<f64>>,
    /// Both headings are in degrees
    #[arg(long)]
    degrees: bool,
    #[command(flatten)]
    pub(crate) place: PlaceArgs,
}

impl PoseArgs {
    /// `[x, y, φ]` \[m, m, rad\]
    pub(crate) fn pose(&self) -> [f64; 3] {
        [self.x, self.y, self.radians(self.heading)]
    }

    /// \[m, m, rad\]
    pub(crate) fn sigma(&self) -> [f64; 3] {
        match self.sigma.as_deref() {
            Some(&[x, y, heading]) => [x, y, self.radians(heading)],
            _ => SIGMA,
        }
    }

    fn radians(&self, angle: f64) -> f64 {
        if self.degrees {
            angle.to_radians()
        } else {
            angle
        }
    }
}

fn number(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| "must be a finite number".into())
}

/// One that is not worn away when it is squared.
fn deviation(text: &str) -> Result<f64, String> {
    let number = number(text)?;
    let may_be = (1e-9..=1e9).contains(&number);
    may_be.then_some(number).ok_or_else(|| {
        "must be a standard deviation, 1e-9 to 1e9: nobody knows a pose exactly".into()
    })
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Debug, Parser)]
    struct Line {
        #[command(flatten)]
        pose: PoseArgs,
    }

    fn parse(words: &str) -> Result<PoseArgs, clap::Error> {
        let all = std::iter::once("pose").chain(words.split_whitespace());
        Line::try_parse_from(all).map(|line| line.pose)
    }

    fn is_near(a: [f64; 3], b: [f64; 3]) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12)
    }

    #[test]
    fn degrees_are_of_both_headings() {
        let args = parse("r1 1 -2.5 -90 --sigma 1 2 180 --degrees").unwrap();
        let quarter = std::f64::consts::FRAC_PI_2;
        assert!(is_near(args.pose(), [1.0, -2.5, -quarter]), "{args:?}");
        assert!(is_near(args.sigma(), [1.0, 2.0, 2.0 * quarter]), "{args:?}");
        let args = parse("r1 1 -2.5 -1").unwrap();
        assert!(is_near(args.pose(), [1.0, -2.5, -1.0]), "{args:?}");
        assert!(is_near(args.sigma(), SIGMA), "{args:?}");
    }

    #[test]
    fn what_is_no_pose_or_is_exact_is_refused() {
        for wrong in [
            "r1 1 2",
            "r1 NaN 2 3",
            "r1 1 inf 3",
            "r1 1 2 north",
            "r1 1 2 3 --sigma 0.1 0 0.1",
            "r1 1 2 3 --sigma 0.1 -1 0.1",
            "r1 1 2 3 --sigma 0.1 NaN 0.1",
            "r1 1 2 3 --sigma 0.1 0.1",
            "a/b 1 2 3",
        ] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
