//! Recordings as they are read: whole ticks with their inputs. What is missing between them is passed over and counted.

use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};

use coloc_estimator::assist::assistant::{Ack, Heard, Words};
use coloc_estimator::assist::readings::HeardReadings;
use coloc_estimator::{
    Belief, Bend, Covariance2, Covariance3, GyroSample, HeadingFix, HeadingOf, Measurement, Motion,
    NeighbourPose, NotACovariance, OdometrySample, Origin, Parts, Pose, PoseSaid, PositionFix,
    RobotId, Sighting, SlowError, Span, Stamp, Start, TickInputs, TrackPose,
};

use super::{Known, Record, Step};

/// A daemon's recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Number in the team.
    pub robot: u16,
    /// When it began.
    pub stamp: Stamp,
    /// What it knew then.
    pub start: Start,
    /// Bias of the gyro and its variance then, if there was one \[rad/s, rad²/s²\].
    pub gyro: Option<[f64; 2]>,
    /// All whole ticks since.
    pub ticks: Vec<RecordedTick>,
    /// What is missing.
    pub gaps: Gaps,
}

/// What a recording has lost.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Gaps {
    /// Ticks that are not there, or not whole.
    pub ticks: u64,
    /// Lines that the daemon could not write, or that cannot be read.
    pub lines: u64,
}

/// A tick's inputs, and the estimate that was published.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedTick {
    /// Counted from 0, lost ones included.
    pub tick: u64,
    /// What the estimator did in it, or ahead of it.
    pub step: Step,
    /// The tick's own stamp; of a step ahead of it, that one's.
    pub stamp: Stamp,
    /// What it took in.
    pub measurements: Vec<Measurement>,
    /// What leaders said of the robot.
    pub data: Vec<Heard>,
    /// What children answered.
    pub acks: Vec<Ack>,
    /// What they saw of children.
    pub readings: Vec<HeardReadings>,
    /// How far the team's clock was ahead of the stamps \[ns\].
    pub ahead_ns: i64,
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
    #[error("this is not the beginning of a recording")]
    NoBeginning,
}

/// A tick of which something is missing or wrong.
struct Broken;

impl From<NotACovariance> for Broken {
    fn from(_: NotACovariance) -> Self {
        Self
    }
}

impl RecordedTick {
    /// As the estimator takes them.
    #[must_use]
    pub fn inputs(&self) -> TickInputs<'_> {
        TickInputs {
            stamp: self.stamp,
            measurements: &self.measurements,
        }
    }

    /// What others said of the robot.
    #[must_use]
    pub fn words(&self) -> Words<'_> {
        Words {
            ahead: Span::from_nanos(self.ahead_ns),
            data: &self.data,
            acks: &self.acks,
            readings: &self.readings,
        }
    }

    fn estimate(&mut self, record: Record) -> Result<(), Broken> {
        let Record::Estimate {
            pose,
            independent,
            dependent,
            bend,
            ..
        } = record
        else {
            return Err(Broken);
        };
        self.belief = belief(pose, independent, dependent, bend)?;
        Ok(())
    }

    fn take(&mut self, record: Record) -> Result<(), Broken> {
        if let Some(taken) = super::assist::take(self, record) {
            return Ok(taken?);
        }
        if let Some(taken) = super::round::taken(&record) {
            self.measurements.push(taken?);
            return Ok(());
        }
        self.measurements.push(match record {
            Record::Odometry { .. } => odometry(record)?.into(),
            Record::Sighting {
                stamp_ns,
                source,
                session,
                sequence,
                observed,
                pose: relative,
                covariance,
                track,
            } => {
                let sighting = Sighting {
                    stamp: Stamp::from_nanos(stamp_ns),
                    origin: origin(source, session, sequence),
                    observed: RobotId(observed),
                    relative: pose(relative),
                    covariance: Covariance3::from_row_major(covariance)?,
                };
                if track {
                    Measurement::Track(TrackPose(sighting))
                } else {
                    Measurement::Sighting(sighting)
                }
            }
            Record::Neighbour {
                stamp_ns,
                sender,
                session,
                sequence,
                pose: seen,
                independent,
                dependent,
            } => Measurement::Neighbour(NeighbourPose {
                stamp: Stamp::from_nanos(stamp_ns),
                origin: origin(sender, session, sequence),
                pose: pose(seen),
                parts: Parts::from_row_major(independent, dependent)?,
            }),
            Record::Fix {
                stamp_ns,
                source,
                session,
                sequence,
                position,
                covariance,
                slow_variance,
                slow_memory_ns,
                lever,
            } => Measurement::Fix(PositionFix {
                stamp: Stamp::from_nanos(stamp_ns),
                origin: origin(source, session, sequence),
                position,
                covariance: Covariance2::from_row_major(covariance)?,
                lever,
                slow: SlowError {
                    variance: slow_variance,
                    memory: Span::from_nanos(slow_memory_ns),
                },
            }),
            Record::Heading { .. } => heading(record)?.into(),
            Record::Gyro {
                stamp_ns,
                source,
                session,
                sequence,
                rate,
                noise,
            } => Measurement::Gyro(GyroSample {
                stamp: Stamp::from_nanos(stamp_ns),
                origin: origin(source, session, sequence),
                rate_radps: rate,
                noise,
            }),
            Record::Pose {
                stamp_ns,
                source,
                session,
                sequence,
                pose: said,
                covariance,
                set,
            } => Measurement::Pose(PoseSaid {
                stamp: Stamp::from_nanos(stamp_ns),
                origin: origin(source, session, sequence),
                pose: pose(said),
                covariance: Covariance3::from_row_major(covariance)?,
                set,
            }),
            other => super::part::measurement(other).ok_or(Broken)??,
        });
        Ok(())
    }
}

/// All that is known of such a belief.
fn position(belief: &Belief) -> Result<Start, NotACovariance> {
    let p = belief.total().matrix();
    let covariance = Covariance2::from_row_major([p.m11, p.m12, p.m21, p.m22])?;
    Ok(Start::Position([belief.pose.x, belief.pose.y], covariance))
}

fn origin(source: u16, session: u64, sequence: u64) -> Origin {
    Origin {
        source,
        session,
        sequence,
    }
}

fn odometry(record: Record) -> Result<OdometrySample, Broken> {
    let Record::Odometry {
        source,
        start_ns,
        stamp_ns,
        holonomic,
        velocity,
        noise,
    } = record
    else {
        return Err(Broken);
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
        source,
        start: Stamp::from_nanos(start_ns),
        stamp: Stamp::from_nanos(stamp_ns),
        motion,
    })
}

fn heading(record: Record) -> Result<HeadingFix, Broken> {
    let Record::Heading {
        stamp_ns,
        source,
        session,
        sequence,
        heading,
        variance,
        slow_variance,
        slow_memory_ns,
        least_m_s,
        lever,
    } = record
    else {
        return Err(Broken);
    };
    let of = least_m_s.map_or(HeadingOf::Body, |least_m_s| HeadingOf::Course {
        least_m_s,
        lever,
    });
    Ok(HeadingFix {
        stamp: Stamp::from_nanos(stamp_ns),
        origin: origin(source, session, sequence),
        heading_rad: heading,
        variance,
        slow: SlowError {
            variance: slow_variance,
            memory: Span::from_nanos(slow_memory_ns),
        },
        of,
    })
}

/// As it was, not wrapped once more.
fn pose([x, y, phi]: [f64; 3]) -> Pose {
    Pose { x, y, phi }
}

fn belief(
    mean: [f64; 3],
    independent: [f64; 9],
    dependent: [f64; 9],
    bend: [f64; 6],
) -> Result<Belief, NotACovariance> {
    Ok(Belief {
        pose: pose(mean),
        parts: Parts::from_row_major(independent, dependent)?,
        bend: Bend::from_array(bend),
    })
}

impl Recording {
    /// Reads a recording.
    ///
    /// # Errors
    /// If it cannot be read, or does not begin as one.
    pub fn read(path: &Path) -> Result<Self, RecordingError> {
        let mut lines = Lines::default();
        let mut read = || {
            lines.reader = Some(BufReader::new(std::fs::File::open(path)?));
            lines.recording()
        };
        read().map_err(|problem| RecordingError {
            path: path.into(),
            line: lines.line,
            problem,
        })
    }
}

/// The lines of a recording, those that are none being passed over and counted.
#[derive(Default)]
struct Lines {
    reader: Option<BufReader<std::fs::File>>,
    line: usize,
    /// Read already, and not used.
    next: Option<Record>,
    /// The number of the last tick that began.
    begun: Option<u64>,
    lost: u64,
}

impl Lines {
    fn next(&mut self) -> Result<Option<Record>, io::Error> {
        if let Some(record) = self.next.take() {
            return Ok(Some(record));
        }
        let mut text = Vec::new();
        while let Some(reader) = &mut self.reader
            && reader.read_until(b'\n', &mut text)? > 0
        {
            self.line += 1;
            match serde_json::from_slice(&text) {
                Ok(Record::Lost { lines }) => self.lost += lines,
                Ok(record) => return Ok(Some(record)),
                Err(_) => self.lost += u64::from(text != b"\n"),
            }
            text.clear();
        }
        Ok(None)
    }

    fn recording(&mut self) -> Result<Recording, Problem> {
        let Some(Record::Begin {
            robot,
            stamp_ns,
            known,
            pose,
            independent,
            dependent,
            bend,
            gyro,
        }) = self.next()?
        else {
            return Err(Problem::NoBeginning);
        };
        let belief = || belief(pose, independent, dependent, bend);
        let start = match known {
            Known::Nothing => Ok(Start::Unknown),
            Known::Position => belief().and_then(|it| position(&it)),
            Known::Pose => belief().map(Start::Known),
        };
        let start = start.map_err(|_| Problem::NoBeginning)?;
        let mut recording = Recording {
            robot,
            stamp: Stamp::from_nanos(stamp_ns),
            start,
            gyro,
            ticks: Vec::new(),
            gaps: Gaps::default(),
        };
        while let Some(record) = self.next()? {
            recording.ticks.extend(self.tick(record)?.ok());
        }
        recording.gaps = Gaps {
            ticks: missing(&recording.ticks, self.begun),
            lines: self.lost,
        };
        Ok(recording)
    }

    /// The tick that begins with `record`.
    fn tick(&mut self, record: Record) -> Result<Result<RecordedTick, Broken>, io::Error> {
        let mut recorded = RecordedTick::default();
        let Record::Tick {
            tick,
            stamp_ns,
            inputs,
            step,
        } = record
        else {
            return Ok(Err(Broken));
        };
        (recorded.tick, recorded.stamp) = (tick, Stamp::from_nanos(stamp_ns));
        recorded.step = step;
        self.begun = Some(tick);
        for _ in 0..inputs {
            if let Err(broken) = self.of_tick()?.and_then(|record| recorded.take(record)) {
                return Ok(Err(broken));
            }
        }
        let estimate = self.of_tick()?;
        Ok(estimate
            .and_then(|estimate| recorded.estimate(estimate))
            .map(|()| recorded))
    }

    /// The next line, unless another tick begins with it.
    fn of_tick(&mut self) -> Result<Result<Record, Broken>, io::Error> {
        let record = self.next()?;
        Ok(match record {
            Some(begin @ Record::Tick { .. }) => {
                self.next = Some(begin);
                Err(Broken)
            }
            Some(record) => Ok(record),
            None => Err(Broken),
        })
    }
}

/// How many of the ticks up to the last that has begun are not there.
fn missing(ticks: &[RecordedTick], begun: Option<u64>) -> u64 {
    let expected = begun.map_or(0, |last| last.saturating_add(1));
    let whole = ticks.iter().filter(|tick| tick.step != Step::Ahead);
    expected.saturating_sub(whole.count() as u64)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use coloc_estimator::assist::assistant::Message;
    use coloc_estimator::assist::cross::Leader;
    use coloc_estimator::assist::datum::Reading;
    use coloc_estimator::assist::readings::{Readings, Sight};
    use coloc_estimator::assist::slot::Slot;
    use coloc_estimator::assist::trail::Trail;
    use coloc_estimator::{Estimate, GlobalPose, GyroSettings, OdometryNoise};

    use super::super::{Recorder, of_words};
    use super::*;

    fn cov(scale: f64) -> Covariance3 {
        Covariance3::diagonal([0.1 * scale, 1.0 / 3.0, -0.0]).unwrap()
    }

    fn compass(stamp: Stamp) -> HeadingFix {
        HeadingFix {
            stamp,
            origin: origin(6, 5, 4),
            heading_rad: 2.0 / 3.0,
            variance: 1e-4 / 3.0,
            slow: SlowError {
                variance: 0.1,
                memory: Span::from_nanos(7),
            },
            of: HeadingOf::Body,
        }
    }

    fn saw(stamp: Stamp, pose: Pose, count: u8) -> HeardReadings {
        let mut readings = Readings {
            slot: Slot(7),
            stamp,
            trace: (count > 0).then_some(1.0 / 3.0),
            trail: (count > 0).then_some(Trail {
                ends: [pose; 8],
                noise: cov(0.1),
            }),
            ..Readings::default()
        };
        for observed in 0..count {
            assert!(readings.push(Sight {
                observed: RobotId(observed.into()),
                since: Span::from_nanos(199_999_999),
                reading: Reading {
                    relative: pose,
                    covariance: cov(0.7),
                },
            }));
        }
        HeardReadings {
            origin: origin(3, 8, u64::from(count)),
            readings,
        }
    }

    fn word(stamp: Stamp, third: Pose, known: u8) -> Heard {
        let mut heard = Heard {
            origin: origin(3, u64::MAX, 8),
            message: Message {
                slot: Slot(i64::MIN),
                stamp,
                robots: 16,
                path: core::array::from_fn(|it| RobotId(u16::try_from(it).unwrap())),
                said: GlobalPose {
                    pose: third,
                    parts: Parts {
                        independent: cov(3.0),
                        dependent: cov(0.7),
                    },
                },
                ..Message::default()
            },
        };
        heard.message.word.leader = Leader {
            pose: third,
            covariance: cov(0.1),
        };
        let past = &mut heard.message.word.past;
        (past.said, past.known) = (known, known);
        for (place, scale) in past.transitions.iter_mut().zip(0..known) {
            *place = [[1.0 / 3.0 + f32::from(scale), 0.1, -0.0]; 3];
        }
        heard
    }

    /// Two ticks, with numbers that no short decimal holds.
    fn recorded() -> Recording {
        let stamp = Stamp::from_nanos(i64::MAX / 3);
        let third = Pose::new(1.0 / 3.0, -2e-17, 0.1 + 0.2);
        let odometry = OdometrySample {
            source: 0,
            start: Stamp::from_nanos(1),
            stamp,
            motion: OdometryNoise::paper().nonholonomic([0.1, -0.7]),
        };
        let compass = compass(stamp);
        let tick = RecordedTick {
            step: Step::Own,
            tick: 0,
            stamp,
            measurements: vec![
                odometry.into(),
                Measurement::Sighting(Sighting {
                    stamp,
                    origin: Origin::counted(u64::MAX),
                    observed: RobotId(3),
                    relative: third,
                    covariance: cov(1.0),
                }),
                Measurement::Neighbour(NeighbourPose {
                    stamp,
                    origin: origin(2, u64::MAX, 7),
                    pose: third,
                    parts: Parts {
                        independent: cov(3.0),
                        dependent: cov(0.7),
                    },
                }),
                Measurement::Fix(PositionFix {
                    stamp,
                    origin: origin(1, 3, 1),
                    position: [1e-300, 0.1],
                    covariance: Covariance2::diagonal([0.01, 0.1]).unwrap(),
                    lever: [1.0 / 3.0, -0.1],
                    slow: SlowError {
                        variance: 1.0 / 3.0,
                        memory: Span::from_nanos(59_999_999_999),
                    },
                }),
                compass.into(),
                HeadingFix {
                    of: HeadingOf::Course {
                        least_m_s: 1.0 / 3.0,
                        lever: [0.1, 2.0 / 3.0],
                    },
                    ..compass
                }
                .into(),
                Measurement::Pose(PoseSaid {
                    stamp,
                    origin: origin(7, 9, 3),
                    pose: third,
                    covariance: cov(2.0),
                    set: true,
                }),
                Measurement::Gyro(GyroSample {
                    stamp,
                    origin: origin(2, 9, 5),
                    rate_radps: -1.0 / 3.0,
                    noise: 1e-9,
                }),
            ],
            data: vec![word(stamp, third, 0), word(stamp, third, 3)],
            acks: vec![Ack {
                robot: RobotId(3),
                slot: Slot(-1),
                stamp,
                leader: RobotId(2),
                taken: true,
            }],
            readings: vec![saw(stamp, third, 0), saw(stamp, third, 2)],
            ahead_ns: -7,
            belief: Belief {
                bend: Bend::from_array([1.0 / 3.0, -2e-17, 0.1, 0.2, 0.3, -1e-300]),
                ..Belief::independent(third, cov(0.3))
            },
        };
        let mut second = RecordedTick {
            tick: 1,
            ..tick.clone()
        };
        second.measurements[0] = Measurement::Odometry(OdometrySample {
            source: 9,
            motion: OdometryNoise::paper().holonomic([0.1, 0.2, 0.3]),
            ..odometry
        });
        Recording {
            robot: 4,
            stamp,
            start: Start::Known(Belief::independent(third, cov(2.0))),
            gyro: Some([1.0 / 3.0, 1e-300]),
            ticks: vec![tick, second],
            gaps: Gaps::default(),
        }
    }

    fn records(recording: &Recording) -> Vec<Record> {
        let mut records = vec![Record::begin(
            recording.robot,
            recording.stamp.as_nanos(),
            &recording.start,
            recording.gyro.map(|[bias, bias_variance]| GyroSettings {
                bias,
                bias_variance,
                ..GyroSettings::ORDINARY
            }),
        )];
        for tick in &recording.ticks {
            let (inputs, words) = (tick.inputs(), tick.words());
            records.extend(of_words(tick.tick, tick.step, &inputs, &words));
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
        let mut recorder = Recorder::start(&path).unwrap();
        for record in records {
            recorder.take(*record);
        }
        recorder.finish(Duration::from_secs(20));
        Recording::read(&path)
    }

    #[test]
    fn what_was_written_is_read_to_the_last_bit() {
        let recording = recorded();
        assert_eq!(read(&records(&recording)).unwrap(), recording);
    }

    /// Ticks 0 to 3, and the number of the tick that each line belongs to.
    fn four_ticks() -> (Vec<Record>, Vec<u64>) {
        let mut recording = recorded();
        for tick in 2..4 {
            let before = recording.ticks[1].clone();
            recording.ticks.push(RecordedTick { tick, ..before });
        }
        let lines = records(&recording);
        let mut ticks = vec![0; lines.len()];
        let mut current = 0;
        for (line, tick) in lines.iter().zip(&mut ticks).rev() {
            if let Record::Estimate { .. } = line {
                current += 1;
            }
            *tick = 4 - current;
        }
        (lines, ticks)
    }

    #[test]
    fn a_lost_line_costs_its_tick_and_no_other() {
        let (whole, ticks) = four_ticks();
        for lost in 1..whole.len() {
            let mut part = whole.clone();
            part[lost] = Record::Lost { lines: 1 };
            let recording = read(&part).unwrap();
            let left: Vec<u64> = recording.ticks.iter().map(|tick| tick.tick).collect();
            let expected: Vec<u64> = (0..4).filter(|&tick| tick != ticks[lost]).collect();
            assert_eq!(left, expected, "line {lost}");
            let is_known = ticks[lost] != 3 || !matches!(whole[lost], Record::Tick { .. });
            let unseen = u64::from(is_known); // Nobody knows how many there would have been.
            assert_eq!(
                recording.gaps,
                Gaps {
                    ticks: unseen,
                    lines: 1
                },
                "line {lost}"
            );
        }
    }

    #[test]
    fn a_line_that_was_cut_off_is_passed_over() {
        let (whole, _) = four_ticks();
        let text: Vec<String> = whole
            .iter()
            .map(|it| serde_json::to_string(it).unwrap())
            .collect();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.jsonl");
        let torn = text
            .join("\n")
            .replacen("\"record\":\"fix\"", "\"reco\n", 1);
        std::fs::write(&path, &torn[..torn.len() - 5]).unwrap();
        let recording = Recording::read(&path).unwrap();
        let left: Vec<u64> = recording.ticks.iter().map(|tick| tick.tick).collect();
        assert_eq!(left, [1, 2]);
        assert_eq!(recording.gaps, Gaps { ticks: 2, lines: 3 });
    }

    #[test]
    fn a_recording_that_ends_within_a_tick_has_a_gap() {
        let (whole, ticks) = four_ticks();
        for left in 2..whole.len() {
            let is_within = ticks[left] == ticks[left - 1];
            let recording = read(&whole[..left]).unwrap();
            assert_eq!(recording.gaps.ticks, u64::from(is_within), "{left} lines");
        }
    }

    #[test]
    fn what_is_no_recording_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.jsonl");
        std::fs::write(&path, "hello\n").unwrap();
        let error = Recording::read(&path).unwrap_err().to_string();
        assert!(
            error.contains("not the beginning of a recording"),
            "{error}"
        );
    }

    #[test]
    fn a_file_that_is_not_there_is_named() {
        let error = Recording::read(Path::new("/nonexistent/a.jsonl")).unwrap_err();
        assert!(error.to_string().contains("/nonexistent/a.jsonl"));
        let directory = Recording::read(Path::new("/")).unwrap_err().to_string();
        assert!(
            directory.contains("directory"),
            "the real reason: {directory}"
        );
    }
}
