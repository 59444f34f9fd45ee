//! How a bus is doing: its state and what has been counted.

use crate::is_broken;

use super::error_frame::{ControllerState, ErrorClass, ErrorCounters, ErrorFrame};

/// Whether frames can be expected from a bus.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum BusState {
    /// Working.
    Up,
    /// Working, with errors: 96 or more counted by the controller.
    ErrorWarning,
    /// Working, with many errors: 128 or more counted by the controller.
    ErrorPassive,
    /// The controller took itself off the bus; it returns by `restart-ms` or `ip link set … type can restart`.
    BusOff,
    /// The interface is there and switched off.
    Down,
    /// The interface, or the local bus's directory, is not there.
    Gone,
    /// Our socket was closed by somebody else, or failed; a new one is being opened.
    Closed,
    /// The recorded log has been played to its end.
    Ended,
}

impl BusState {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Up,
        Self::ErrorWarning,
        Self::ErrorPassive,
        Self::BusOff,
        Self::Down,
        Self::Gone,
        Self::Closed,
        Self::Ended,
    ];

    /// Whether frames can arrive at all in this state.
    #[must_use]
    pub fn receives(self) -> bool {
        matches!(self, Self::Up | Self::ErrorWarning | Self::ErrorPassive)
    }
}

impl From<ControllerState> for BusState {
    fn from(state: ControllerState) -> Self {
        match state {
            ControllerState::Active => Self::Up,
            ControllerState::Warning => Self::ErrorWarning,
            ControllerState::Passive => Self::ErrorPassive,
            ControllerState::BusOff => Self::BusOff,
        }
    }
}

/// What has been counted since the start; never reset.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct BusCounters {
    /// Data and remote frames handed on.
    pub frames: u64,
    /// Frames that passed the kernel but not the filter.
    pub unwanted: u64,
    /// Datagrams that are no frame (size or length field wrong), or damaged lines of a log.
    pub malformed: u64,
    /// Error frames.
    pub error_frames: u64,
    /// Error frames by class; one frame may count in several. Index with [`BusCounters::of`].
    pub by_class: [u64; ErrorClass::ALL.len()],
    /// Frames that the kernel dropped because our receive buffer was full (`SO_RXQ_OVFL`).
    pub receive_drops: u64,
    /// Overflows inside the controller.
    pub controller_overflows: u64,
    /// Attempts to open the bus again.
    pub reopen_attempts: u64,
    /// Attempts that succeeded.
    pub reopened: u64,
}

impl BusCounters {
    /// How many error frames carried `class`.
    #[must_use]
    pub fn of(&self, class: ErrorClass) -> u64 {
        self.by_class[class as usize]
    }
}

/// State and counters of one bus.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct BusHealth {
    /// What to expect.
    pub state: BusState,
    /// What has been.
    pub counters: BusCounters,
    /// The controller's own error counters, as last reported.
    pub controller: ErrorCounters,
}

impl BusHealth {
    pub(super) fn new(state: BusState) -> Self {
        Self {
            state,
            counters: BusCounters::default(),
            controller: ErrorCounters::default(),
        }
    }

    /// Accounts for a data or remote frame: proof that the controller is on the bus. That an interface is up again it does
    /// not prove: the frame may have been in the queue when it went down.
    pub(super) fn note_frame(&mut self) {
        self.counters.frames += 1;
        if self.state == BusState::BusOff {
            self.state = BusState::Up;
        }
    }

    pub(super) fn note_error(&mut self, error: ErrorFrame) {
        self.counters.error_frames += 1;
        self.counters.controller_overflows += u64::from(error.receive_overflow());
        for class in error.classes() {
            self.counters.by_class[class as usize] += 1;
        }
        if let Some(state) = error.announced_state().filter(|_| !is_broken("bus_off")) {
            self.state = state.into();
        }
        self.controller = error.counters().unwrap_or(self.controller);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Frame;
    use super::*;

    fn note(health: &mut BusHealth, class: ErrorClass, data: [u8; 8]) {
        health.note_error(Frame::error_frame(class.bit(), data).error().unwrap());
    }

    #[test]
    fn the_state_follows_the_controller_off_the_bus_and_back() {
        let mut health = BusHealth::new(BusState::Up);
        note(
            &mut health,
            ErrorClass::Controller,
            [0, 0x30, 0, 0, 0, 0, 0, 0],
        );
        assert_eq!(health.state, BusState::ErrorPassive);
        health.note_frame();
        assert_eq!(
            health.state,
            BusState::ErrorPassive,
            "an error-passive controller still receives"
        );
        note(&mut health, ErrorClass::BusOff, [0; 8]);
        assert_eq!(health.state, BusState::BusOff);
        note(&mut health, ErrorClass::Restarted, [0; 8]);
        assert_eq!(health.state, BusState::Up);
        assert_eq!(
            (
                health.counters.of(ErrorClass::BusOff),
                health.counters.error_frames
            ),
            (1, 3)
        );
    }

    #[test]
    fn a_frame_proves_that_bus_off_is_over() {
        let mut health = BusHealth::new(BusState::BusOff);
        health.note_frame();
        assert_eq!(health.state, BusState::Up);
    }

    #[test]
    fn a_frame_from_before_does_not_bring_an_interface_up() {
        let mut health = BusHealth::new(BusState::Down);
        health.note_frame();
        assert_eq!(health.state, BusState::Down);
    }
}
