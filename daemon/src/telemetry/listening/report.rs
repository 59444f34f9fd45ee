//! The line that says why there is no odometry.

use std::fmt;
use std::time::Duration;

use coloc_drivers::can::{BusSpec, BusState, Heard, Id, OpenError, identifier, raw_id};
use coloc_drivers::encoder::{Expected, FrameReject};

use crate::hearing::Reception;

/// Everything that is known about it.
pub(super) struct Report<'a> {
    pub(super) silent: Duration,
    pub(super) buses: &'a [BusSpec],
    /// The channel of a base, if there is one.
    pub(super) base: Option<&'a str>,
    pub(super) states: Vec<BusState>,
    pub(super) expected: &'a [Expected],
    /// What was heard on each bus, if somebody listened.
    pub(super) heard: &'a [Result<Heard, OpenError>],
    /// Since the last sample.
    pub(super) reception: Reception,
}

impl fmt::Display for Report<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no odometry for {:.1} s", self.silent.as_secs_f64())?;
        for bus in 0..self.buses.len() {
            self.bus(bus, f)?;
        }
        self.base(f)?;
        self.decoder(f)
    }
}

impl Report<'_> {
    fn base(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(channel) = self.base else {
            return Ok(());
        };
        match self.reception.base {
            [0, _] => write!(f, "; nobody says anything on {channel}"),
            [heard, refused] => write!(
                f,
                "; {channel} brings {heard} messages, of which {refused} are refused"
            ),
        }
    }

    fn bus(&self, bus: usize, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let state = self.states.get(bus).copied().unwrap_or(BusState::Up);
        let Some(spec) = self.buses.get(bus) else {
            return Ok(());
        };
        write!(f, "; {spec} {}", condition(spec, state))?;
        match self.heard.get(bus) {
            Some(Ok(heard)) if matters(spec, state) => self.heard_on(bus, spec, heard, f)?,
            Some(Err(problem)) => write!(f, ", and listening in fails: {problem}")?,
            _ => {}
        }
        self.wanted_from(bus, f)
    }

    fn heard_on(
        &self,
        bus: usize,
        spec: &BusSpec,
        heard: &Heard,
        f: &mut fmt::Formatter<'_>,
    ) -> fmt::Result {
        let verb = match spec {
            BusSpec::Candump { .. } => "holds",
            _ => "brings",
        };
        write!(f, " and {verb} {heard}")?;
        if heard.errors > 0 {
            write!(f, " and {} error frames", heard.errors)?;
        }
        let missing = self.expected_on(bus).filter(|it| heard.of(it.id) == 0);
        for hint in missing.filter_map(|it| hint(it.id, heard)) {
            write!(f, " ({hint})")?;
        }
        Ok(())
    }

    /// By what the decoder has got, which heard for longer than anybody who listened in.
    fn wanted_from(&self, bus: usize, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = self.expected.iter().zip(self.reception.heard);
        let own = counts.filter(|(it, _)| usize::from(it.bus) == bus);
        let (came, missing): (Vec<_>, Vec<_>) = own.partition(|(_, count)| *count > 0);
        let list = |messages: &[(&Expected, u64)], counted: bool| {
            let one = |(it, count): &(&Expected, u64)| {
                if counted {
                    format!("{it} × {count}")
                } else {
                    it.to_string()
                }
            };
            messages.iter().map(one).collect::<Vec<_>>().join(", ")
        };
        if !missing.is_empty() {
            write!(f, ", wanted and not heard: {}", list(&missing, false))?;
        }
        if !came.is_empty() {
            write!(f, ", wanted and heard: {}", list(&came, true))?;
        }
        Ok(())
    }

    fn expected_on(&self, bus: usize) -> impl Iterator<Item = &Expected> {
        let own = move |it: &&Expected| usize::from(it.bus) == bus;
        self.expected.iter().filter(own)
    }

    fn decoder(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = FrameReject::ALL.into_iter().zip(self.reception.refused);
        let refused = counts.filter(|(_, count)| *count > 0);
        let refused: Vec<_> = refused
            .map(|(reason, count)| format!("{reason} × {count}"))
            .collect();
        if !refused.is_empty() {
            write!(f, "; refused: {}", refused.join(", "))?;
        }
        let unsure = self.reception.unsure;
        if unsure > 0 {
            write!(
                f,
                "; too long from one frame to the next to tell the way × {unsure}: lower max_speed_mps, or send more often"
            )?;
        }
        Ok(())
    }
}

/// Whether what is heard there says more than the state does.
fn matters(spec: &BusSpec, state: BusState) -> bool {
    state.receives() || matches!(spec, BusSpec::Candump { .. })
}

fn condition(spec: &BusSpec, state: BusState) -> &'static str {
    match (state, spec) {
        (BusState::Up, _) => "is up",
        (BusState::ErrorWarning, _) => "is up, with errors",
        (BusState::ErrorPassive, _) => "is up, with many errors",
        (BusState::BusOff, _) => "is off: its controller left the bus after too many errors",
        (BusState::Down, _) => "is switched off: ip link set it up",
        (BusState::Gone, BusSpec::Local { .. }) => {
            "is not there: its directory or our socket in it was removed"
        }
        (BusState::Gone, _) => "is not there: no such interface",
        (BusState::Closed, _) => "was closed and is opened again",
        (BusState::Ended, _) => "has been played to its end",
    }
}

/// Something heard that may be what is wanted, under another identifier.
fn hint(wanted: Id, heard: &Heard) -> Option<String> {
    let (want, mask) = (raw_id(wanted) & libc::CAN_EFF_MASK, 0x1FFF_FF00);
    let is_extended = matches!(wanted, Id::Extended(_));
    heard.ids.iter().flatten().find_map(|&(id, _)| {
        let is = raw_id(id) & libc::CAN_EFF_MASK;
        let both = is_extended && matches!(id, Id::Extended(_));
        let (wanted, id) = (identifier(wanted), identifier(id));
        if is == want {
            return Some(format!(
                "{id} has the number of {wanted}, and is of the other kind"
            ));
        }
        (both && is & mask == want & mask).then(|| {
            format!("{id} is {wanted} but for the last byte, in J1939 the sender's address")
        })
    })
}

#[cfg(test)]
mod tests {
    use coloc_drivers::can::{ExtendedId, Frame, StandardId};

    use super::*;
    use crate::hearing::Hearing;

    fn standard(id: u16) -> Id {
        StandardId::new(id).unwrap().into()
    }

    fn extended(id: u32) -> Id {
        ExtendedId::new(id).unwrap().into()
    }

    fn expected(id: Id, message: &str) -> Expected {
        Expected {
            bus: 0,
            id,
            message: message.into(),
            period_us: 20_000,
        }
    }

    fn heard(ids: &[(Id, u32)]) -> Vec<Result<Heard, OpenError>> {
        let mut heard = Heard::default();
        for &(id, count) in ids {
            let frame = Frame::data_frame(id, &[]).unwrap();
            (0..count).for_each(|_| heard.note(&frame));
        }
        vec![Ok(heard)]
    }

    /// What is said of one bus.
    fn said(
        spec: &str,
        state: BusState,
        expected: &[Expected],
        heard: &[Result<Heard, OpenError>],
        change: impl Fn(&mut Reception),
    ) -> String {
        let mut reception = Hearing::new().reception();
        change(&mut reception);
        Report {
            silent: Duration::from_millis(1449),
            buses: &[spec.parse().unwrap()],
            base: None,
            states: vec![state],
            expected,
            heard,
            reception,
        }
        .to_string()
    }

    fn wheels() -> [Expected; 2] {
        [
            expected(standard(0x100), "WheelLeft"),
            expected(standard(0x101), "WheelRight"),
        ]
    }

    #[test]
    fn a_silent_bus() {
        assert_eq!(
            said(
                "socketcan:can0",
                BusState::Up,
                &wheels(),
                &heard(&[]),
                |_| {}
            ),
            "no odometry for 1.4 s; socketcan:can0 is up and brings no frame, wanted and not heard: 0x100 (WheelLeft), 0x101 \
             (WheelRight)"
        );
    }

    #[test]
    fn a_base_that_says_nothing_or_nothing_of_use() {
        let said = |base| {
            let mut reception = Hearing::new().reception();
            reception.base = base;
            let report = Report {
                silent: Duration::from_secs(2),
                buses: &[],
                base: Some("coloc/a/odometry"),
                states: Vec::new(),
                expected: &[],
                heard: &[],
                reception,
            };
            report.to_string()
        };
        assert_eq!(
            [said([0, 0]), said([7, 6])],
            [
                "no odometry for 2.0 s; nobody says anything on coloc/a/odometry",
                "no odometry for 2.0 s; coloc/a/odometry brings 7 messages, of which 6 are refused"
            ]
        );
    }

    #[test]
    fn what_others_say_and_what_is_missing() {
        let heard = heard(&[(standard(0x100), 10), (standard(0x200), 3)]);
        assert_eq!(
            said("local:/x", BusState::Up, &wheels(), &heard, |it| it.heard =
                [60, 0, 0, 0]),
            "no odometry for 1.4 s; local:/x is up and brings 0x100 × 10, 0x200 × 3, wanted and not heard: 0x101 (WheelRight), \
             wanted and heard: 0x100 (WheelLeft) × 60"
        );
    }

    #[test]
    fn what_was_refused_and_why() {
        let all = heard(&[(standard(0x100), 10), (standard(0x101), 10)]);
        let said = said("local:/x", BusState::Up, &wheels(), &all, |it| {
            it.heard = [60, 60, 0, 0];
            it.refused[FrameReject::Checksum as usize] = 60;
            it.refused[FrameReject::Repeated as usize] = 59;
            it.unsure = 7;
        });
        assert!(
            said.ends_with(
                "; refused: wrong checksum × 60, alive counter repeated × 59; too long from one frame to the next to tell the way × 7: \
                 lower max_speed_mps, or send more often"
            ),
            "{said}"
        );
    }

    #[test]
    fn a_bus_that_cannot_bring_anything() {
        for (spec, state, expected) in [
            (
                "local:/x",
                BusState::Gone,
                "local:/x is not there: its directory or our socket in it was removed, wanted",
            ),
            (
                "socketcan:can0",
                BusState::Gone,
                "socketcan:can0 is not there: no such interface, wanted",
            ),
            (
                "socketcan:can0",
                BusState::Down,
                "socketcan:can0 is switched off: ip link set it up, wanted",
            ),
            (
                "candump:a.log",
                BusState::Ended,
                "candump:a.log has been played to its end and holds 0x100 × 1, wanted",
            ),
        ] {
            let said = said(
                spec,
                state,
                &wheels(),
                &heard(&[(standard(0x100), 1)]),
                |_| {},
            );
            assert!(said.contains(expected), "{said}");
        }
    }

    #[test]
    fn what_may_be_meant_is_pointed_out() {
        let tractor = [expected(extended(0x18FE_F1FE), "Speeds")];
        let said_of = |ids: &[(Id, u32)]| {
            said(
                "socketcan:can0",
                BusState::Up,
                &tractor,
                &heard(ids),
                |_| {},
            )
        };
        let other_sender = said_of(&[(extended(0x18FE_F10B), 1)]);
        assert!(
            other_sender.contains("(0x18FEF10B (extended) is 0x18FEF1FE (extended) but for the last byte, in J1939 the sender's address)"),
            "{other_sender}"
        );
        assert!(!said_of(&[(extended(0x18FE_F20B), 1)]).contains("but for"));
        let short = [expected(standard(0x100), "WheelLeft")];
        let other_kind = said(
            "socketcan:can0",
            BusState::Up,
            &short,
            &heard(&[(extended(0x100), 1)]),
            |_| {},
        );
        assert!(
            other_kind.contains(
                "(0x00000100 (extended) has the number of 0x100, and is of the other kind)"
            ),
            "{other_kind}"
        );
    }

    #[test]
    fn who_cannot_listen_says_why() {
        let problem = Err(OpenError::NoCan);
        let said = said(
            "socketcan:can0",
            BusState::Up,
            &wheels(),
            &[problem],
            |_| {},
        );
        assert!(
            said.contains(
                "socketcan:can0 is up, and listening in fails: this kernel offers no CAN sockets"
            ),
            "{said}"
        );
        let nobody = super::tests::said("local:/x", BusState::Up, &wheels(), &[], |_| {});
        assert!(
            nobody
                .starts_with("no odometry for 1.4 s; local:/x is up, wanted and not heard: 0x100"),
            "{nobody}"
        );
    }
}
