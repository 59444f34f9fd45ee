//! Frames of encoders in any order and state: no velocity that a wheel cannot have, none that takes no time.

use coloc_drivers::can::{BusSpec, Frame, Received};
use coloc_drivers::encoder::{
    LEFT_ID, OdometryConfig, OdometryDecoder, RIGHT_ID, Tolerance, WheelOdometry, encoder_frame,
};

use super::Target;
use super::bytes::Bytes;

pub(super) const TARGET: Target = Target {
    name: "encoder",
    run,
    samples,
};

const TRACK_M: f64 = 0.5;
const MAX_SPEED_MPS: f64 = 2.0;

/// Both wheels, and what they last said.
#[derive(Default)]
struct Wheels {
    ticks: [u32; 2],
    alive: [u8; 2],
    stamp_ns: i64,
}

fn run(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let mut decoder = OdometryDecoder::new(&config(bytes.byte())).unwrap();
    let mut wheels = Wheels::default();
    while !bytes.is_empty() {
        let received = wheels.next(&mut bytes);
        let _ = decoder.due_ns(&received);
        if let Ok(Some(sample)) = decoder.push(&received) {
            check(&sample);
        }
    }
}

fn check(sample: &WheelOdometry) {
    let [v, sideways, omega] = sample.velocity;
    let fastest = v.abs() + (omega * TRACK_M / 2.0).abs();
    assert!(fastest <= MAX_SPEED_MPS * (1.0 + 1e-9), "{sample:?}");
    assert!(
        sideways == 0.0 && sample.start_ns < sample.stamp_ns,
        "{sample:?}"
    );
}

impl Wheels {
    fn next(&mut self, bytes: &mut Bytes<'_>) -> Received {
        let how = bytes.byte();
        let wheel = usize::from(how & 1);
        let id = [LEFT_ID, RIGHT_ID][wheel];
        self.move_on(wheel, how, bytes);
        let frame = match how >> 5 {
            0 => Frame::data_frame(id, &bytes.array::<8>()[..usize::from(how >> 1) & 7]).unwrap(),
            _ => encoder_frame(id, self.ticks[wheel], self.alive[wheel]),
        };
        Received {
            frame,
            stamp_ns: self.stamp_ns,
            bus: u8::from(how == 0xFF),
        }
    }

    /// As a wheel does, or as none does.
    fn move_on(&mut self, wheel: usize, how: u8, bytes: &mut Bytes<'_>) {
        let (ticks, alive) = (&mut self.ticks[wheel], &mut self.alive[wheel]);
        *ticks = match how >> 1 & 3 {
            0 => bytes.word(),
            _ => ticks.wrapping_add_signed(bytes.short().into()),
        };
        *alive = match how >> 3 & 3 {
            0 => bytes.byte(),
            _ => alive.wrapping_add(1) & 0x0F,
        };
        self.stamp_ns = match bytes.byte() {
            0 => bytes.long(),
            step @ 1..64 => self
                .stamp_ns
                .saturating_sub(1_000_000 * i64::from(step - 1)),
            step => self.stamp_ns.saturating_add(500_000 * i64::from(step - 64)),
        };
    }
}

/// Some that robots have.
fn config(which: u8) -> OdometryConfig {
    let bus = BusSpec::Local {
        directory: "/nowhere".into(),
    };
    OdometryConfig {
        tolerance: Tolerance {
            late_stamp_s: f64::from(which % 8) * 0.02,
            ..Tolerance::default()
        },
        ..OdometryConfig::differential(bus, TRACK_M, 1e-4, MAX_SPEED_MPS)
    }
}

fn samples() -> Vec<Vec<u8>> {
    // Wheel, ticks, 20 ms with every second frame.
    let frames = |ticks: i16| {
        (0..40_u8).flat_map(move |k| {
            let [low, high] = ticks.to_le_bytes();
            [0x2A | k & 1, low, high, 64 + 40 * (k & 1)]
        })
    };
    let drives = |first: u8, ticks| std::iter::once(first).chain(frames(ticks)).collect();
    vec![drives(3, 200), drives(0, -300), drives(5, 0)]
}
