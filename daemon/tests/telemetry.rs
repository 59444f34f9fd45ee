//! A defect in the telemetry thread: it begins anew, and watches meanwhile.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

mod support;

use std::fmt::{Debug, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

use coloc_daemon::config::Config;
use coloc_daemon::event::{Event, Link};
use coloc_daemon::telemetry::Telemetry;
use coloc_shm_types::BusState;
use support::{PATIENCE, Site};
use tracing::field::{Field, Visit};
use tracing::{Metadata, span};

/// What there is to say here.
const TOLD: [&str; 3] = ["can: ", "telemetry begins anew", "tick"];

/// A log of which the first of these lines is a panic.
struct Defective {
    lines: Sender<String>,
    has_panicked: AtomicBool,
}

struct Line(String);

impl Visit for Line {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        write!(self.0, "{}={value:?} ", field.name()).unwrap();
    }
}

impl tracing::Subscriber for Defective {
    fn enabled(&self, _: &Metadata<'_>) -> bool {
        true
    }

    fn new_span(&self, _: &span::Attributes<'_>) -> span::Id {
        span::Id::from_u64(1)
    }

    fn record(&self, _: &span::Id, _: &span::Record<'_>) {}

    fn record_follows_from(&self, _: &span::Id, _: &span::Id) {}

    fn event(&self, event: &tracing::Event<'_>) {
        let mut line = Line(String::new());
        event.record(&mut line);
        if !TOLD.iter().any(|part| line.0.contains(part)) {
            return; // Of the wheels that nobody turns.
        }
        self.lines.send(line.0).unwrap();
        assert!(
            self.has_panicked.swap(true, Ordering::Relaxed),
            "on purpose"
        );
    }

    fn enter(&self, _: &span::Id) {}

    fn exit(&self, _: &span::Id) {}
}

fn bus(to: BusState) -> Event {
    let from = BusState::Active;
    Event::Bus { from, to }
}

/// The next line says this.
fn expect(lines: &Receiver<String>, part: &str) {
    let line = lines.recv_timeout(PATIENCE).unwrap();
    assert!(line.contains(part), "{line} instead of {part}");
}

#[test]
fn after_a_defect_it_begins_anew_and_watches_meanwhile() {
    let site = Site::new("robot1", "");
    let config = Config::load(&site.config_path()).unwrap();
    let link = Arc::new(Link::new());
    let (lines, said) = channel();
    let (stop, stopped) = channel();
    let (_space, spaces) = channel();
    let defective = Defective {
        lines,
        has_panicked: AtomicBool::new(false),
    };
    let telemetry = {
        let link = Arc::clone(&link);
        std::thread::spawn(move || {
            tracing::subscriber::with_default(defective, || {
                Telemetry::new(&config, link, spaces).run(&stopped)
            })
        })
    };
    link.beat(1);
    link.tell(bus(BusState::Off)).unwrap();
    expect(&said, "can: ");
    expect(&said, "telemetry begins anew");
    // Only after the pause is this told; that there is no tick is told during it.
    link.tell(bus(BusState::Down)).unwrap();
    expect(&said, "no tick");
    expect(&said, "can: ");
    link.beat(2);
    expect(&said, "the tick is back");
    drop(stop);
    telemetry.join().unwrap().unwrap();
}
