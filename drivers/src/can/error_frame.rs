//! Error frames: what the controller says about the bus.

use socketcan::errors::ControllerProblems;

/// A class of error, one bit of an error frame's identifier (`linux/can/error.h`).
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum ErrorClass {
    /// The driver gave up on a transmission.
    TransmitTimeout,
    /// Another node's frame had priority.
    LostArbitration,
    /// The controller changed state or overflowed: see [`ErrorFrame::controller`].
    Controller,
    /// A frame on the bus broke the protocol.
    Protocol,
    /// Wiring: the transceiver sees a short or an open line.
    Transceiver,
    /// Nobody acknowledged a transmission.
    NoAcknowledge,
    /// The controller left the bus after too many errors.
    BusOff,
    /// Errors on the bus, possibly very many.
    BusError,
    /// The controller came back from bus-off.
    Restarted,
    /// Error counters are attached.
    Counters,
}

impl ErrorClass {
    /// In the order of their bits.
    pub const ALL: [Self; 10] = [
        Self::TransmitTimeout,
        Self::LostArbitration,
        Self::Controller,
        Self::Protocol,
        Self::Transceiver,
        Self::NoAcknowledge,
        Self::BusOff,
        Self::BusError,
        Self::Restarted,
        Self::Counters,
    ];

    /// This class's bit in the identifier of an error frame.
    #[must_use]
    pub const fn bit(self) -> u32 {
        1 << self as u32
    }
}

/// How well the controller can take part in the bus (ISO 11898-1 fault confinement).
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ControllerState {
    /// Fewer than 96 errors counted.
    Active,
    /// 96 errors or more.
    Warning,
    /// 128 errors or more: it may no longer disturb others.
    Passive,
    /// 256 transmit errors: it takes no part in the bus any more.
    BusOff,
}

/// A decoded error frame.
///
/// | where | content |
/// | --- | --- |
/// | `can_id` bits 0–9 | classes, see [`ErrorClass`]; several at once are common |
/// | byte 1 | controller problems, a bit field |
/// | byte 6, 7 | transmit and receive error counter, if class [`ErrorClass::Counters`] is set |
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct ErrorFrame {
    classes: u32,
    controller: ControllerProblems,
    counters: Option<ErrorCounters>,
}

/// The controller's error counters.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct ErrorCounters {
    /// Errors while sending.
    pub transmit: u8,
    /// Errors while receiving.
    pub receive: u8,
}

impl ErrorFrame {
    pub(super) fn decode(classes: u32, data: &[u8; 64]) -> Self {
        let has = |class: ErrorClass| classes & class.bit() != 0;
        let problems = if has(ErrorClass::Controller) {
            data[1]
        } else {
            0
        };
        Self {
            classes,
            controller: ControllerProblems::from_bits_truncate(problems),
            counters: has(ErrorClass::Counters).then_some(ErrorCounters {
                transmit: data[6],
                receive: data[7],
            }),
        }
    }

    /// Whether `class` is set.
    #[must_use]
    pub fn has(&self, class: ErrorClass) -> bool {
        self.classes & class.bit() != 0
    }

    /// All classes that are set.
    pub fn classes(&self) -> impl Iterator<Item = ErrorClass> {
        ErrorClass::ALL.into_iter().filter(|&class| self.has(class))
    }

    /// The problems that class [`ErrorClass::Controller`] reports.
    #[must_use]
    pub fn controller(&self) -> ControllerProblems {
        self.controller
    }

    /// The counters that class [`ErrorClass::Counters`] reports.
    #[must_use]
    pub fn counters(&self) -> Option<ErrorCounters> {
        self.counters
    }

    /// Whether the controller lost a frame because nobody read it in time.
    #[must_use]
    pub fn receive_overflow(&self) -> bool {
        self.controller.contains(ControllerProblems::RX_OVERFLOW)
    }

    /// The state that this frame announces, if it announces one.
    #[must_use]
    pub fn announced_state(&self) -> Option<ControllerState> {
        if self.has(ErrorClass::BusOff) {
            return Some(ControllerState::BusOff);
        }
        if self.has(ErrorClass::Restarted) {
            return Some(ControllerState::Active);
        }
        self.controller_state()
            .or_else(|| self.counters.map(state_of_counters))
    }

    fn controller_state(self) -> Option<ControllerState> {
        use ControllerProblems as Problem;
        let any = |problems: Problem| self.controller.intersects(problems);
        [
            (
                Problem::RX_PASSIVE | Problem::TX_PASSIVE,
                ControllerState::Passive,
            ),
            (
                Problem::RX_WARNING | Problem::TX_WARNING,
                ControllerState::Warning,
            ),
            (Problem::ACTIVE, ControllerState::Active),
        ]
        .into_iter()
        .find_map(|(problems, state)| any(problems).then_some(state))
    }
}

fn state_of_counters(counters: ErrorCounters) -> ControllerState {
    match counters.transmit.max(counters.receive) {
        128.. => ControllerState::Passive,
        96.. => ControllerState::Warning,
        _ => ControllerState::Active,
    }
}

#[cfg(test)]
mod tests {
    use super::super::Frame;
    use super::*;

    fn error(classes: u32, data: [u8; 8]) -> ErrorFrame {
        Frame::error_frame(classes, data).error().unwrap()
    }

    #[test]
    fn bits_are_the_kernels() {
        use socketcan::errors as kernel;
        assert_eq!(ErrorClass::Controller.bit(), kernel::CAN_ERR_CRTL);
        assert_eq!(ErrorClass::BusOff.bit(), kernel::CAN_ERR_BUSOFF);
        assert_eq!(ErrorClass::Restarted.bit(), kernel::CAN_ERR_RESTARTED);
        assert_eq!(ErrorClass::Counters.bit(), kernel::CAN_ERR_CNT);
        assert!(
            ErrorClass::ALL
                .windows(2)
                .all(|pair| pair[0].bit() << 1 == pair[1].bit())
        );
    }

    #[test]
    fn each_class_is_recognised_alone() {
        for class in ErrorClass::ALL {
            assert_eq!(
                error(class.bit(), [0; 8]).classes().collect::<Vec<_>>(),
                [class]
            );
        }
    }

    #[test]
    fn states_follow_the_announcement() {
        let controller = |problems| {
            error(
                ErrorClass::Controller.bit(),
                [0, problems, 0, 0, 0, 0, 0, 0],
            )
            .announced_state()
        };
        assert_eq!(controller(0x04), Some(ControllerState::Warning));
        assert_eq!(controller(0x10), Some(ControllerState::Passive));
        assert_eq!(controller(0x20), Some(ControllerState::Passive));
        assert_eq!(controller(0x40), Some(ControllerState::Active));
        assert_eq!(
            controller(0x01),
            None,
            "an overflow says nothing about the state"
        );
        assert_eq!(
            error(0x40, [0; 8]).announced_state(),
            Some(ControllerState::BusOff)
        );
        assert_eq!(
            error(0x100, [0; 8]).announced_state(),
            Some(ControllerState::Active)
        );
        assert_eq!(error(0x80, [0; 8]).announced_state(), None);
    }

    #[test]
    fn counters_tell_the_state_where_nothing_else_does() {
        let counters = |tx, rx| error(0x200, [0, 0, 0, 0, 0, 0, tx, rx]).announced_state();
        assert_eq!(counters(0, 95), Some(ControllerState::Active));
        assert_eq!(counters(96, 0), Some(ControllerState::Warning));
        assert_eq!(counters(0, 128), Some(ControllerState::Passive));
        assert_eq!(
            error(0x204, [0, 0x40, 0, 0, 0, 0, 200, 0]).announced_state(),
            Some(ControllerState::Active)
        );
    }

    #[test]
    fn details_of_classes_that_are_not_set_are_ignored() {
        let frame = error(ErrorClass::BusError.bit(), [0xFF; 8]);
        assert_eq!((frame.counters(), frame.receive_overflow()), (None, false));
        assert!(error(ErrorClass::Controller.bit(), [0, 1, 0, 0, 0, 0, 0, 0]).receive_overflow());
    }
}
