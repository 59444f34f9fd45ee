//! What robots tell a leader that they saw, whatever it holds: refused, or each child is told once an event, by a way from this leader on,
//! a pose that can be.

use std::collections::BTreeSet;

use coloc_daemon::collect::assist::readings;
use coloc_estimator::assist::assistant::{Told, Words, step};
use coloc_estimator::assist::readings::HeardReadings;
use coloc_estimator::{Measurement, Parts, Pose, RobotId, Span, Stamp, TickInputs};
use coloc_shm_types::{Readings, Sight};

use super::Target;
use super::assists::{
    BEGIN_NS, EVENT_NS, LEADERS, PERIOD_NS, TICKS, header, limits, of_team, robot, sighting,
};
use super::bytes::Bytes;

pub(super) const TARGET: Target = Target {
    name: "readings",
    run: |bytes| {
        play(bytes);
    },
    samples,
};

const OWN: u16 = LEADERS[0];
const DEADLINE: Span = Span::from_millis(80);

/// How often it tells a child.
fn play(bytes: &[u8]) -> usize {
    let mut bytes = Bytes(bytes);
    let (mut estimator, mut assistant) = of_team(OWN, |it| it.readings_deadline = Some(DEADLINE));
    let mut told = BTreeSet::new();
    for tick in 1..=TICKS {
        if bytes.is_empty() {
            break;
        }
        let now_ns = BEGIN_NS + tick * PERIOD_NS;
        let spoken = spoken(&mut bytes, now_ns);
        let inputs = TickInputs {
            stamp: Stamp::from_nanos(now_ns),
            measurements: &spoken.seen,
        };
        let words = Words {
            readings: &spoken.readings,
            ..Words::default()
        };
        let (outputs, carried) = step(&mut estimator, &mut assistant, &inputs, &words);
        let belief = outputs.estimate.belief;
        let Pose { x, y, phi } = belief.pose;
        assert!([x, y, phi].iter().all(|it| it.is_finite()), "{belief:?}");
        for it in carried.data {
            check(it);
            let event = (it.message.slot, it.to);
            assert!(told.insert(event), "told twice: {event:?}");
        }
    }
    told.len()
}

fn check(told: &Told) {
    let message = &told.message;
    let [first, further @ ..] = message.robots() else {
        panic!("from nobody: {message:?}");
    };
    let leaders = LEADERS.map(RobotId);
    let robots: BTreeSet<_> = further.iter().collect();
    assert_eq!(*first, RobotId(OWN));
    assert_eq!(further.last(), Some(&told.to));
    assert!(message.is_final && robots.len() == further.len());
    assert!(!further.iter().any(|it| leaders.contains(it)));
    let Pose { x, y, phi } = message.said.pose;
    assert!([x, y, phi].iter().all(|it| it.is_finite()), "{message:?}");
    let Parts {
        independent,
        dependent,
    } = message.said.parts;
    let again = Parts::from_row_major(independent.to_row_major(), dependent.to_row_major());
    assert_eq!(again.err(), None, "{message:?}");
}

/// What comes in a tick, as far as it is valid.
#[derive(Default)]
struct Spoken {
    readings: Vec<HeardReadings>,
    seen: Vec<Measurement>,
}

fn spoken(bytes: &mut Bytes<'_>, now_ns: i64) -> Spoken {
    let mut spoken = Spoken::default();
    for _ in 0..bytes.byte() % 6 {
        if bytes.byte().is_multiple_of(4) {
            spoken.seen.push(sighting(bytes, now_ns));
        } else {
            let heard = readings(&statement(bytes, now_ns), &limits(now_ns, OWN));
            spoken.readings.extend(heard);
        }
    }
    spoken
}

/// Mostly of the event that was over last.
fn statement(bytes: &mut Bytes<'_>, now_ns: i64) -> Readings {
    let mut header = header(bytes, now_ns);
    let last = now_ns.div_euclid(EVENT_NS) - 1;
    let how = bytes.byte();
    let slot = match how % 8 {
        5 => last - 1,
        6 => last + 1,
        7 => bytes.long(),
        _ => last,
    };
    if how < 0xE0 {
        header.stamp_ns = slot.wrapping_mul(EVENT_NS).wrapping_add(EVENT_NS / 2);
    }
    let flags = bytes.byte() % 5;
    let (leads, goes) = (flags & Readings::LEADS != 0, flags & Readings::WAY != 0);
    let count = bytes.byte() % 18;
    let mut readings = Readings {
        header,
        slot,
        count,
        flags,
        ..Readings::default()
    };
    for sight in readings.sights.iter_mut().take(usize::from(count)) {
        *sight = seen(bytes);
    }
    if leads {
        readings.trace = bytes.number();
    }
    if goes {
        readings.way = std::array::from_fn(|_| bytes.numbers());
        readings.way_covariance = bytes.covariance();
    }
    readings
}

fn seen(bytes: &mut Bytes<'_>) -> Sight {
    let since = bytes.byte();
    Sight {
        since_ns: match since {
            255 => bytes.long(),
            _ => i64::from(since % 102) * 1_000_000,
        },
        pose: bytes.numbers(),
        covariance: bytes.covariance(),
        observed: robot(bytes.byte()),
        ..Sight::default()
    }
}

fn samples() -> Vec<Vec<u8>> {
    let number = |value: i16| [&[0][..], &value.to_le_bytes()].concat();
    let numbers = |values: &[i16]| values.iter().copied().flat_map(number).collect::<Vec<u8>>();
    let unit = || {
        let entries: [i16; 9] = std::array::from_fn(|k| if k % 4 == 0 { 300 } else { 0 });
        [vec![1], numbers(&entries)].concat()
    };
    // How old, sequence, source; then where it is.
    let own = |child: u8| [vec![0, 0, 1, 1], numbers(&[2000, 100, 30]), vec![child]].concat();
    let sight = |child: u8, since_ms: u8| {
        let pose = numbers(&[1000, -500, 100]);
        [vec![since_ms], pose, unit(), vec![child]].concat()
    };
    // As late as it may be, the event that was over last, how it went.
    let child = |source: u8, observed: u8| {
        let way: Vec<_> = (1..=8).flat_map(|k| numbers(&[10 * k, k, k])).collect();
        let begin = vec![1, 0, 1, source, 0, 2, 1];
        [begin, sight(observed, 40), way, unit()].concat()
    };
    let leader = |observed: u8| {
        let begin = vec![1, 0, 1, 2, 0, 1, 1];
        [begin, sight(observed, 20), number(500)].concat()
    };
    let silent = |ticks: usize| vec![0; ticks];
    // An event is five ticks, of which the first begins one; what it is about is worked out in the fourth tick of the next.
    let event = |said: &[Vec<u8>]| {
        let count = vec![u8::try_from(said.len()).unwrap()];
        [vec![1], own(3), silent(5), count, said.concat(), silent(3)].concat()
    };
    let alone = event(&[]);
    let chain = event(&[child(3, 4), child(4, 5)]);
    let with_another = event(&[leader(4), child(3, 5), child(4, 5), child(5, 3)]);
    vec![
        alone,
        chain.clone(),
        with_another.clone(),
        [chain, with_another].concat(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_come_through_to_the_trees() {
        let told: Vec<_> = samples().iter().map(|it| play(it)).collect();
        assert_eq!(told, [1, 3, 2, 5]);
        let inputs = TARGET.inputs(1, 1000);
        let by_others = inputs.filter(|it| play(it) > 1).count();
        assert!(by_others > 200, "{by_others} of 1000");
    }
}
