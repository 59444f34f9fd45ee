//! How much of the processors the daemons took.

use std::fs::read_to_string;

/// The processor time of the children of this process that have ended, since it was made. A program that `cargo run` started has
/// the compilers among its children: their time does not count.
#[derive(Copy, Clone, Debug)]
pub(crate) struct ChildrenTime {
    before_s: f64,
}

impl ChildrenTime {
    pub(crate) fn start() -> Self {
        Self {
            before_s: ended_children_s(),
        }
    }

    /// What was added since \[s\]; zero where the kernel does not tell.
    pub(crate) fn passed_s(self) -> f64 {
        ended_children_s() - self.before_s
    }
}

fn ended_children_s() -> f64 {
    let stat = read_to_string("/proc/self/stat").ok();
    stat.as_deref().and_then(of_children).unwrap_or(0.0)
}

/// The 16th and the 17th field, cutime and cstime, in hundredths of a second \[s\].
fn of_children(stat: &str) -> Option<f64> {
    // The second field is a name, which may contain anything; the third comes after the last bracket.
    let (_, fields) = stat.rsplit_once(')')?;
    let mut times = fields.split_whitespace().skip(13).map(str::parse::<f64>);
    let (user, system) = (times.next()?.ok()?, times.next()?.ok()?);
    Some((user + system) / 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    #[test]
    fn the_times_are_found_behind_any_name() {
        let stat = "7 (a) 1 b) S 1 7 7 0 -1 4194304 95 0 2 0 30 40 1234 66 20 0 1 0";
        assert_eq!(of_children(stat), Some(13.0));
        assert_eq!(of_children("7 (a) S 1"), None);
    }

    #[test]
    fn who_ended_before_does_not_count() {
        let work = || {
            Command::new("sh")
                .args(["-c", "i=0; while [ $i -lt 200000 ]; do i=$((i+1)); done"])
                .status()
        };
        assert!(work().unwrap().success());
        let earlier = ChildrenTime { before_s: 0.0 };
        let time = ChildrenTime::start();
        assert!(work().unwrap().success());
        assert!(
            time.passed_s() > 0.0,
            "a child that counts takes hundredths of a second"
        );
        assert!(earlier.passed_s() > time.passed_s());
    }
}
