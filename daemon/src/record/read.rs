//! Recordings as they are read: ticks with their inputs, complete or refused.

use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};

use coloc_estimator::{
    Belief, Covariance2, Covariance3, Motion, NeighbourPose, NotACovariance, OdometrySample, Pose,
    PositionFix, RobotId, Sighting, Stamp, TickInputs,
};

use super::Record;

/// A daemon's recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Number in the team.
    pub robot: u16,
    /// When it began.
    pub stamp: Stamp,
    /// What it believed then.
    pub initial: Belief,
    /// All ticks since, without a gap.
    pub ticks: Vec<RecordedTick>,
}

/// A tick's inputs, and the estimate that was published.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedTick {
    /// The clock was stepped before it: what was the first is now the second.
    pub rebase: Option<(Stamp, Stamp)>,
    /// The tick's own stamp.
    pub stamp: Stamp,
    /// Of the wheels.
    pub odometry: Vec<OdometrySample>,
    /// Own ones.
    pub sightings: Vec<Sighting>,
    /// From others.
    pub neighbours: Vec<NeighbourPose>,
    /// Own ones.
    pub fixes: Vec<PositionFix>,
    /// What was published.
    pub belief: Belief,
}

/// Why a recording cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{path}:{line}: {problem}", path = path.display())]
pub struct RecordingError {
    path: PathBuf,
    line: usize,
    problem: Problem,
}

#[derive(Debug, thiserror::Error)]
enum Problem {
    #[error("cannot be read: {0}")]
    Unreadable(#[from] io::Error),
    #[error("not a line of a recording: {0}")]
    Malformed(#[from] serde_json::Error),
    #[error("{0}")]
    Covariance(#[from] NotACovariance),
    #[error("{0} is missing here: the recording has lost lines (is the disk too slow?)")]
    Missing(&'static str),
}

impl RecordedTick {
    /// As the estimator takes them.
    #[must_use]
    pub fn inputs(&self) -> TickInputs<'_> {
        TickInputs {
            stamp: self.stamp,
            odometry: &self.odometry,
            sightings: &self.sightings,
            neighbours: &self.neighbours,
            fixes: &self.fixes,
        }
    }

    fn take(&mut self, record: Record) -> Result<(), Problem> {
        match record {
            Record::Odometry { .. } => self.odometry.push(odometry(record)?),
            Record::Sighting {
                stamp_ns,
                sequence,
                observed,
                pose: relative,
                covariance,
            } => self.sightings.push(Sighting {
                stamp: Stamp::from_nanos(stamp_ns),
                sequence,
                observed: RobotId(observed),
                relative: pose(relative),
                covariance: Covariance3::from_row_major(covariance)?,
            }),
            Record::Neighbour {
                stamp_ns,
                sequence,
                sender,
                pose: seen,
                total,
                independent,
            } => self.neighbours.push(NeighbourPose {
                stamp: Stamp::from_nanos(stamp_ns),
                sequence,
                sender: RobotId(sender),
                pose: pose(seen),
                total: Covariance3::from_row_major(total)?,
                independent: Covariance3::from_row_major(independent)?,
            }),
            Record::Fix {
                stamp_ns,
                sequence,
                position,
                covariance,
            } => self.fixes.push(PositionFix {
                stamp: Stamp::from_nanos(stamp_ns),
                sequence,
                position,
                covariance: Covariance2::from_row_major(covariance)?,
            }),
            _ => return Err(Problem::Missing("an input")),
        }
        Ok(())
    }
}

fn odometry(record: Record) -> Result<OdometrySample, Problem> {
    let Record::Odometry {
        start_ns,
        stamp_ns,
        holonomic,
        velocity,
        noise,
    } = record
    else {
        return Err(Problem::Missing("an odometry sample"));
    };
    let [vv, _, vw, _, _, _, wv, _, ww] = noise;
    let motion = if holonomic {
        let noise = Covariance3::from_row_major(noise)?;
        Motion::Holonomic { velocity, noise }
    } else {
        let [v, _, omega] = velocity;
        let noise = Covariance2::from_row_major([vv, vw, wv, ww])?;
        Motion::Nonholonomic {
            velocity: [v, omega],
            noise,
        }
    };
    Ok(OdometrySample {
        start: Stamp::from_nanos(start_ns),
        stamp: Stamp::from_nanos(stamp_ns),
        motion,
    })
}

/// As it was, not wrapped once more.
fn pose([x, y, phi]: [f64; 3]) -> Pose {
    Pose { x, y, phi }
}

fn belief(mean: [f64; 3], total: [f64; 9], independent: [f64; 9]) -> Result<Belief, Problem> {
    Ok(Belief {
        pose: pose(mean),
        total: Covariance3::from_row_major(total)?,
        independent: Covariance3::from_row_major(independent)?,
    })
}

impl Recording {
    /// Reads a whole recording.
    ///
    /// # Errors
    /// The first line that is wrong or missing.
    pub fn read(path: &Path) -> Result<Self, RecordingError> {
        let mut lines = Lines {
            reader: std::fs::File::open(path).ok().map(BufReader::new),
            line: 0,
        };
        lines.recording().map_err(|problem| RecordingError {
            path: path.into(),
            line: lines.line,
            problem,
        })
    }
}

struct Lines<R> {
    /// None if the file could not be opened.
    reader: Option<R>,
    line: usize,
}

impl<R: BufRead> Lines<R> {
    fn next(&mut self) -> Result<Option<Record>, Problem> {
        let reader = self
            .reader
            .as_mut()
            .ok_or_else(|| io::Error::from(io::ErrorKind::NotFound))?;
        let mut text = String::new();
        self.line += 1;
        if reader.read_line(&mut text)? == 0 {
            return Ok(None);
        }
        Ok(Some(serde_json::from_str(&text)?))
    }

    fn recording(&mut self) -> Result<Recording, Problem> {
        let Some(Record::Begin {
            robot,
            stamp_ns,
            pose,
            total,
            independent,
        }) = self.next()?
        else {
            return Err(Problem::Missing("the beginning"));
        };
        let mut recording = Recording {
            robot,
            stamp: Stamp::from_nanos(stamp_ns),
            initial: belief(pose, total, independent)?,
            ticks: Vec::new(),
        };
        while let Some(record) = self.next()? {
            let tick = self.tick(record, recording.ticks.len() as u64)?;
            recording.ticks.push(tick);
        }
        Ok(recording)
    }

    fn tick(&mut self, mut record: Record, number: u64) -> Result<RecordedTick, Problem> {
        let mut recorded = RecordedTick::default();
        while let Record::Rebase { old_ns, new_ns } = record {
            recorded.rebase = Some((Stamp::from_nanos(old_ns), Stamp::from_nanos(new_ns)));
            record = self.next()?.ok_or(Problem::Missing("a tick"))?;
        }
        let Record::Tick {
            tick,
            stamp_ns,
            inputs,
        } = record
        else {
            return Err(Problem::Missing("a tick"));
        };
        if tick != number {
            return Err(Problem::Missing("the tick before"));
        }
        recorded.stamp = Stamp::from_nanos(stamp_ns);
        for _ in 0..inputs {
            recorded.take(self.next()?.ok_or(Problem::Missing("an input"))?)?;
        }
        let Some(Record::Estimate {
            pose,
            total,
            independent,
            ..
        }) = self.next()?
        else {
            return Err(Problem::Missing("the estimate"));
        };
        recorded.belief = belief(pose, total, independent)?;
        Ok(recorded)
    }
}

#[cfg(test)]
mod tests {
    use coloc_estimator::{Estimate, OdometryNoise};

    use super::super::{Recorder, of_inputs};
    use super::*;

    fn cov(scale: f64) -> Covariance3 {
        Covariance3::diagonal([0.1 * scale, 1.0 / 3.0, -0.0]).unwrap()
    }

    /// Two ticks, with numbers that no short decimal holds.
    fn recorded() -> Recording {
        let stamp = Stamp::from_nanos(i64::MAX / 3);
        let third = Pose::new(1.0 / 3.0, -2e-17, 0.1 + 0.2);
        let tick = RecordedTick {
            stamp,
            odometry: vec![OdometrySample {
                start: Stamp::from_nanos(1),
                stamp,
                motion: OdometryNoise::paper().nonholonomic([0.1, -0.7]),
            }],
            sightings: vec![Sighting {
                stamp,
                sequence: u64::MAX,
                observed: RobotId(3),
                relative: third,
                covariance: cov(1.0),
            }],
            neighbours: vec![NeighbourPose {
                stamp,
                sequence: 7,
                sender: RobotId(2),
                pose: third,
                total: cov(3.0),
                independent: Covariance3::ZERO,
            }],
            fixes: vec![PositionFix {
                stamp,
                sequence: 1,
                position: [1e-300, 0.1],
                covariance: Covariance2::diagonal([0.01, 0.1]).unwrap(),
            }],
            belief: Belief::independent(third, cov(0.3)),
            rebase: None,
        };
        let holonomic = OdometrySample {
            motion: OdometryNoise::paper().holonomic([0.1, 0.2, 0.3]),
            ..tick.odometry[0]
        };
        let second = RecordedTick {
            odometry: vec![holonomic],
            rebase: Some((stamp, Stamp::from_nanos(5))),
            ..tick.clone()
        };
        Recording {
            robot: 4,
            stamp,
            initial: Belief::independent(third, cov(2.0)),
            ticks: vec![tick, second],
        }
    }

    fn records(recording: &Recording) -> Vec<Record> {
        let mut records = vec![Record::begin(
            recording.robot,
            recording.stamp.as_nanos(),
            &recording.initial,
        )];
        for (tick, number) in recording.ticks.iter().zip(0..) {
            records.extend(tick.rebase.map(|(old, new)| Record::Rebase {
                old_ns: old.as_nanos(),
                new_ns: new.as_nanos(),
            }));
            records.extend(of_inputs(number, &tick.inputs()));
            records.push(Record::from(&Estimate {
                stamp: tick.stamp,
                belief: tick.belief,
                ..Estimate::default()
            }));
        }
        records
    }

    fn read(records: &[Record]) -> Result<Recording, RecordingError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.jsonl");
        let mut recorder = Recorder::create(&path).unwrap();
        for record in records {
            recorder.write(record);
        }
        recorder.flush();
        Recording::read(&path)
    }

    #[test]
    fn what_was_written_is_read_to_the_last_bit() {
        let recording = recorded();
        assert_eq!(read(&records(&recording)).unwrap(), recording);
    }

    #[test]
    fn any_lost_line_is_noticed() {
        let whole = records(&recorded());
        for lost in (0..whole.len()).filter(|&lost| !matches!(whole[lost], Record::Rebase { .. })) {
            let mut part = whole.clone();
            part.remove(lost);
            let error = read(&part).unwrap_err().to_string();
            assert!(error.contains("missing"), "line {lost}: {error}");
        }
    }

    #[test]
    fn a_file_that_is_not_there_is_named() {
        let error = Recording::read(Path::new("/nonexistent/a.jsonl")).unwrap_err();
        assert!(error.to_string().contains("/nonexistent/a.jsonl"));
    }
}
