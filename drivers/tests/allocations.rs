//! After start-up nothing allocates: not on good days, not while a bus is lost and found, not on garbage.
#![allow(clippy::unwrap_used, reason = "a test")]

use std::hint::black_box;
use std::io::Write;

use coloc_counting::{Calls, calls_during};
use coloc_drivers::can::{Bus, BusSpec, BusState, ErrorClass, Filter, Frame, Received, Sender};
use coloc_drivers::encoder::{LEFT_ID, OdometryConfig, OdometryDecoder, WheelFrames};

fn supervise(bus: &mut Bus, now_ns: i64) -> Calls {
    calls_during(|| bus.supervise(now_ns)).1
}

fn decoder() -> OdometryDecoder {
    let bus = BusSpec::Local {
        directory: "/nowhere".into(),
    };
    OdometryDecoder::new(&OdometryConfig::differential(bus, 0.5, 1e-4, 2.0)).unwrap()
}

fn drain(bus: &mut Bus, decoder: &mut OdometryDecoder) -> Calls {
    let drained = calls_during(|| {
        bus.receive(&mut |received| {
            let _ = black_box(decoder.push(received));
        });
    });
    drained.1
}

#[test]
fn receiving_and_decoding_never_allocate() {
    let directory = tempfile::tempdir().unwrap();
    let spec = BusSpec::Local {
        directory: directory.path().to_owned(),
    };
    let mut decoder = decoder();
    let mut bus = Bus::open(&spec, 0, Filter::ids(decoder.wanted_ids(0))).unwrap();
    let mut sender = Sender::open(&spec).unwrap();
    let mut wheels = WheelFrames::new(1e-4);
    for (period, class) in (0..1000).zip(ErrorClass::ALL.into_iter().cycle()) {
        // However fast they are sent: the whole way is no more than late frames explain.
        let way_m = f64::from(period) * 1e-4;
        let error = Frame::error_frame(class.bit(), [0xFF; 8]);
        let garbage = Frame::data_frame(LEFT_ID, &[0xFF; 5]).unwrap();
        for frame in wheels
            .encode(way_m, way_m)
            .into_iter()
            .chain([error, garbage])
        {
            sender.send(&frame).unwrap();
        }
        assert_eq!(
            drain(&mut bus, &mut decoder),
            Calls::NONE,
            "period {period}"
        );
        assert_eq!(
            supervise(&mut bus, i64::from(period) * 20_000_000),
            Calls::NONE
        );
    }
    // Frames sent within a millisecond share a sample, so how many there are is up to the machine.
    assert_eq!(decoder.counters().accepted, 2000);
    assert_eq!(bus.health().counters.error_frames, 1000);
}

#[test]
fn losing_a_bus_and_finding_it_again_never_allocates() {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path().join("bus");
    let mut bus = Bus::open(
        &BusSpec::Local {
            directory: place.clone(),
        },
        0,
        Filter::All,
    )
    .unwrap();
    let mut decoder = decoder();
    let mut now_ns = 1_000_000_000;
    for round in 1..=3 {
        for (there, state) in [(false, BusState::Gone), (true, BusState::Up)] {
            if there {
                std::fs::create_dir(&place)
            } else {
                std::fs::remove_dir_all(&place)
            }
            .unwrap();
            for _ in 0..20 {
                now_ns += 20_000_000;
                assert_eq!(supervise(&mut bus, now_ns), Calls::NONE);
                assert_eq!(drain(&mut bus, &mut decoder), Calls::NONE);
            }
            assert_eq!(bus.health().state, state, "round {round}");
        }
    }
    assert_eq!(bus.health().counters.reopened, 3);
}

#[test]
fn playing_a_log_never_allocates() {
    let mut log = tempfile::NamedTempFile::new().unwrap();
    (0..2000).for_each(|n| writeln!(log, "(1.{n:06}) can0 {:03X}#0102030405", n % 0x800).unwrap());
    let spec = BusSpec::Candump {
        path: log.path().to_owned(),
        interface: None,
    };
    let mut bus = Bus::open(&spec, 0, Filter::All).unwrap();
    let mut frames = 0;
    while bus.health().state != BusState::Ended {
        let (_, calls) = calls_during(|| bus.receive(&mut |_: &Received| frames += 1));
        assert_eq!(calls, Calls::NONE);
    }
    assert_eq!(frames, 2000);
}
