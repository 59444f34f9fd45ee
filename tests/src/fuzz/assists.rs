//! What leaders say of a child, and what other children answer it, whatever it holds: refused, or taken once a leader and event, and the
//! belief stays one that can be.

use std::collections::BTreeSet;

use coloc_daemon::collect::assist::{ack, datum};
use coloc_estimator::assist::assistant::{Ack, Agreement, Assistant, Heard, Words, step};
use coloc_estimator::assist::search::Patience;
use coloc_estimator::{
    Belief, Covariance3, Estimator, Measurement, Origin, Pose, RobotId, Settings, Sighting, Slot,
    Span, Stamp, TickInputs,
};
use coloc_shm_types::{Assist, AssistAck, Clock, Header, Limits, Present};

use super::Target;
use super::bytes::Bytes;

pub(super) const TARGET: Target = Target {
    name: "assists",
    run,
    samples,
};

pub(super) const PERIOD_NS: i64 = 20_000_000;
const HISTORY_NS: i64 = 1_000_000_000;
const BOOT: u64 = 7;
/// Two leaders and three children, of which this is the first.
pub(super) const ROBOTS: [u16; 5] = [1, 2, 3, 4, 5];
pub(super) const LEADERS: [u16; 2] = [1, 2];
const OWN: u16 = 3;
pub(super) const BEGIN_NS: i64 = 10 * HISTORY_NS;
/// Of an event.
pub(super) const EVENT_NS: i64 = 100_000_000;
/// Ticks of an execution.
pub(super) const TICKS: i64 = 24;

/// Who is there, by a byte; now and then nobody of the team.
pub(super) fn robot(byte: u8) -> u16 {
    u16::from(byte % 7)
}

pub(super) fn limits(now_ns: i64, own: u16) -> Limits<'static> {
    Limits {
        now: Present::only(Clock::Boottime, now_ns),
        boot: BOOT,
        history_ns: HISTORY_NS,
        future_tolerance_ns: 0,
        own,
        robots: &ROBOTS,
    }
}

fn agreement() -> Agreement {
    let ids = ROBOTS.map(RobotId);
    let (leaders, children) = ids.split_at(LEADERS.len());
    let patience = Patience {
        ack_timeout: 60,
        close_after: 200,
    };
    Agreement::new(leaders, children, Span::from_nanos(EVENT_NS), patience).unwrap()
}

/// One of them, in an agreement that `change` may change.
pub(super) fn of_team(
    own: u16,
    change: impl FnOnce(&mut Agreement),
) -> (Estimator<Vec<Slot>>, Assistant) {
    let mut agreement = agreement();
    change(&mut agreement);
    let covariance = Covariance3::diagonal([0.04, 0.04, 0.01]).unwrap();
    let belief = Belief::independent(Pose::new(1.0, 2.0, 0.5), covariance);
    let slots = vec![Slot::default(); 64];
    let begin = Stamp::from_nanos(BEGIN_NS);
    (
        Estimator::new(Settings::default(), begin, belief, slots),
        Assistant::new(agreement, RobotId(own)).unwrap(),
    )
}

fn run(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let (mut estimator, mut assistant) = of_team(OWN, |_| ());
    let mut taken = BTreeSet::new();
    for tick in 1..=TICKS {
        if bytes.is_empty() {
            return;
        }
        let now_ns = BEGIN_NS + tick * PERIOD_NS;
        let words = spoken(&mut bytes, now_ns);
        let inputs = TickInputs {
            stamp: Stamp::from_nanos(now_ns),
            measurements: &words.seen,
        };
        let said = Words {
            ahead: Span::ZERO,
            data: &words.data,
            acks: &words.acks,
            ..Words::default()
        };
        let (outputs, carried) = step(&mut estimator, &mut assistant, &inputs, &said);
        let belief = outputs.estimate.belief;
        let Pose { x, y, phi } = belief.pose;
        assert!([x, y, phi].iter().all(|it| it.is_finite()), "{belief:?}");
        assert!(belief.total().contains(&belief.parts.independent));
        for told in carried.data {
            let path = &told.message.path[..usize::from(told.message.robots)];
            assert!(path.contains(&RobotId(OWN)) && told.to != RobotId(OWN));
        }
        for ack in carried.acks.iter().filter(|it| it.taken) {
            taken.insert((ack.slot, ack.leader, ack.robot));
        }
    }
    let of: BTreeSet<_> = taken
        .iter()
        .map(|(slot, leader, _)| (slot, leader))
        .collect();
    assert_eq!(
        of.len(),
        taken.len(),
        "one leader's datum by two ways: {taken:?}"
    );
}

/// What comes in a tick, as far as it is valid.
#[derive(Default)]
struct Spoken {
    data: Vec<Heard>,
    acks: Vec<Ack>,
    seen: Vec<Measurement>,
}

fn spoken(bytes: &mut Bytes<'_>, now_ns: i64) -> Spoken {
    let mut spoken = Spoken::default();
    for _ in 0..bytes.byte() % 6 {
        match bytes.byte() % 4 {
            0 | 1 => {
                let heard = datum(&assist(bytes, now_ns), &limits(now_ns, OWN), &LEADERS);
                spoken.data.extend(heard);
            }
            2 => spoken
                .acks
                .extend(ack(&answer(bytes, now_ns), &limits(now_ns, OWN))),
            _ => spoken.seen.push(sighting(bytes, now_ns)),
        }
    }
    spoken
}

pub(super) fn header(bytes: &mut Bytes<'_>, now_ns: i64) -> Header {
    let how = bytes.byte();
    Header {
        stamp_ns: match how % 16 {
            15 => bytes.long(),
            _ => now_ns - PERIOD_NS * i64::from(how % 16),
        },
        session: u64::from(how >> 7),
        sequence: u64::from(bytes.byte()),
        boot: BOOT,
        source: robot(bytes.byte()),
        clock: Clock::Boottime as u8,
        ..Header::default()
    }
}

/// The number of the event is that of its stamp, or is not.
fn slot(bytes: &mut Bytes<'_>, header: &Header) -> i64 {
    let of = header.stamp_ns.div_euclid(EVENT_NS);
    match bytes.byte() % 8 {
        0 => bytes.long(),
        1 => of - 1,
        _ => of,
    }
}

#[allow(clippy::cast_possible_truncation)] // As a leader says it.
fn as_said(number: f64) -> f32 {
    number as f32
}

fn assist(bytes: &mut Bytes<'_>, now_ns: i64) -> Assist {
    let header = header(bytes, now_ns);
    let slot = slot(bytes, &header);
    let robots = bytes.byte() % 18;
    let mut path = [0; 16];
    for place in path.iter_mut().take(usize::from(robots)) {
        *place = robot(bytes.byte());
    }
    let (said, known) = (bytes.byte() % 3, bytes.byte() % 3);
    let mut transitions = [[0.0; 9]; 8];
    for rows in transitions.iter_mut().take(usize::from(said)) {
        *rows = bytes.covariance().map(as_said);
    }
    Assist {
        header,
        slot,
        robots,
        path,
        said,
        known,
        transitions,
        flags: bytes.byte() % 3,
        pose: bytes.numbers(),
        independent: bytes.covariance(),
        dependent: bytes.covariance(),
        leader_pose: bytes.numbers(),
        leader_covariance: bytes.covariance(),
        ..Assist::default()
    }
}

fn answer(bytes: &mut Bytes<'_>, now_ns: i64) -> AssistAck {
    let header = header(bytes, now_ns);
    AssistAck {
        header,
        slot: slot(bytes, &header),
        leader: robot(bytes.byte()),
        taken: bytes.byte() % 3,
        ..AssistAck::default()
    }
}

pub(super) fn sighting(bytes: &mut Bytes<'_>, now_ns: i64) -> Measurement {
    let Header {
        stamp_ns, sequence, ..
    } = header(bytes, now_ns);
    let [x, y, phi] = bytes.numbers();
    let relative = Pose::new(x, y, phi);
    Sighting {
        stamp: Stamp::from_nanos(stamp_ns),
        origin: Origin::counted(sequence),
        observed: RobotId(robot(bytes.byte())),
        relative,
        covariance: Covariance3::diagonal([0.01, 0.01, 0.001]).unwrap(),
    }
    .into()
}

fn samples() -> Vec<Vec<u8>> {
    let number = |value: i16| [&[0][..], &value.to_le_bytes()].concat();
    let numbers = |values: &[i16]| values.iter().copied().flat_map(number).collect::<Vec<u8>>();
    let unit = || {
        let entries = (0..9).map(|k| number(if k % 4 == 0 { 300 } else { 0 }));
        [vec![1], entries.flatten().collect()].concat()
    };
    // How old, sequence, source; the right event.
    let datum = |path: &[u8], last: u8| {
        [
            vec![0, 0, 1, last, 2, u8::try_from(path.len()).unwrap()],
            path.to_vec(),
            vec![0, 0, 0], // Nothing is said of its error, and no flag.
            numbers(&[1100, 2000, 500]),
            unit(),
            unit(),
            numbers(&[0, 0, 0]),
            unit(),
        ]
        .concat()
    };
    let seen = |child: u8| [vec![3, 0, 1, 3], numbers(&[2000, 100, 30]), vec![child]].concat();
    let answer = vec![2, 0, 1, 4, 2, 1, 1];
    let first = [vec![3], seen(4), seen(5), datum(&[1, 3], 1)].concat();
    let second = [vec![2], datum(&[2, 4, 3], 4), answer].concat();
    vec![
        first.clone(),
        [first.clone(), second.clone()].concat(),
        [first.clone(), second.clone(), first, second].concat(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Data, answers and sightings of an input that are valid.
    fn valid(input: &[u8]) -> [usize; 3] {
        let (mut bytes, mut valid, mut now_ns) = (Bytes(input), [0; 3], BEGIN_NS);
        while !bytes.is_empty() {
            now_ns += PERIOD_NS;
            let spoken = spoken(&mut bytes, now_ns);
            let counts = [spoken.data.len(), spoken.acks.len(), spoken.seen.len()];
            valid = [0, 1, 2].map(|it| valid[it] + counts[it]);
        }
        valid
    }

    #[test]
    fn inputs_come_through_to_the_search() {
        let found: Vec<_> = samples().iter().map(|it| valid(it)).collect();
        assert_eq!(found, [[1, 0, 2], [2, 1, 2], [4, 2, 4]]);
        let inputs = TARGET.inputs(1, 1000);
        let come_through = inputs.filter(|input| valid(input)[0] > 0).count();
        assert!(come_through > 200, "{come_through} of 1000");
    }
}
