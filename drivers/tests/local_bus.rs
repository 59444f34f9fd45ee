//! The local bus between participants: delivery, stamps, filters, full queues, the dead and the vanished.

#![allow(clippy::unwrap_used, reason = "a test")]

use std::error::Error;
use std::os::fd::AsFd;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use coloc_counting::{Calls, calls_during};
use coloc_drivers::can::{
    Bus, BusSpec, BusState, ErrorClass, Filter, Frame, Id, Received, Sender, StandardId,
};
use rustix::event::{PollFd, PollFlags, Timespec, poll};

type Fallible = Result<(), Box<dyn Error>>;

fn spec(directory: &Path) -> BusSpec {
    BusSpec::Local {
        directory: directory.to_owned(),
    }
}

fn frame(id: u16, data: &[u8]) -> Frame {
    Frame::data_frame(StandardId::new(id).unwrap(), data).unwrap()
}

fn receive(bus: &mut Bus) -> Vec<Received> {
    let mut all = Vec::new();
    bus.receive(&mut |received| all.push(*received));
    all
}

fn readable(bus: &Bus) -> bool {
    let mut fds = [PollFd::new(bus, PollFlags::IN)];
    poll(&mut fds, Some(&Timespec::default())).unwrap() == 1
}

fn realtime_ns() -> i64 {
    i64::try_from(
        SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap()
            .as_nanos(),
    )
    .unwrap()
}

/// Supervises for `ms` milliseconds of a clock that only the test knows.
fn supervise(bus: &mut Bus, from_ms: i64, ms: i64) {
    for now_ms in from_ms..from_ms + ms {
        bus.supervise(now_ms * 1_000_000);
    }
}

#[test]
fn everybody_gets_every_frame_with_the_kernels_stamp() -> Fallible {
    let directory = tempfile::tempdir()?;
    let mut buses = (0..5)
        .map(|n| Bus::open(&spec(directory.path()), n, Filter::All))
        .collect::<Result<Vec<_>, _>>()?;
    let mut sender = Sender::open(&spec(directory.path()))?;
    let sent = [
        frame(0x100, &[1, 2, 3]),
        Frame::fd_frame(StandardId::MAX, &[7; 64]).ok_or("too long")?,
    ];
    let before_ns = realtime_ns();
    for frame in &sent {
        sender.send(frame)?;
    }
    let after_ns = realtime_ns();
    for (number, bus) in (0..).zip(&mut buses) {
        assert!(readable(bus));
        let got = receive(bus);
        assert_eq!(
            got.iter()
                .map(|received| received.frame)
                .collect::<Vec<_>>(),
            sent
        );
        assert!(got.iter().all(|received| received.bus == number));
        assert!(
            got.iter()
                .all(|received| (before_ns..=after_ns).contains(&received.stamp_ns)),
            "{got:?}"
        );
        assert!(!readable(bus));
        assert_eq!(
            (bus.health().state, bus.health().counters.frames),
            (BusState::Up, 2)
        );
    }
    Ok(())
}

/// Its listeners come and go meanwhile, and are found.
#[test]
fn sending_allocates_nothing() -> Fallible {
    let directory = tempfile::tempdir()?;
    let mut buses = Vec::new();
    let mut sender = Sender::open(&spec(directory.path()))?;
    for number in 0..6_u8 {
        buses.push(Bus::open(&spec(directory.path()), number, Filter::All)?);
        if number == 3 {
            buses.remove(0);
        }
        // Longer than a newcomer may go unnoticed.
        std::thread::sleep(std::time::Duration::from_millis(60));
        let (sent, calls) = calls_during(|| sender.send(&frame(0x100, &[number])));
        sent?;
        assert_eq!(calls, Calls::NONE, "{number}");
        assert!(buses.iter_mut().all(|bus| receive(bus).len() == 1));
    }
    Ok(())
}

#[test]
fn other_nodes_frames_wake_nobody() -> Fallible {
    let directory = tempfile::tempdir()?;
    let wanted = Id::Standard(StandardId::new(0x101).ok_or("no such identifier")?);
    let mut bus = Bus::open(&spec(directory.path()), 0, Filter::ids([wanted]))?;
    let mut sender = Sender::open(&spec(directory.path()))?;
    for _ in 0..1000 {
        sender.send(&frame(0x100, &[0; 8]))?;
    }
    assert!(!readable(&bus));
    sender.send(&frame(0x101, &[42]))?;
    sender.send(
        &Frame::remote_frame(StandardId::new(0x101).ok_or("no such identifier")?, 8)
            .ok_or("too long")?,
    )?;
    sender.send(&Frame::error_frame(ErrorClass::BusOff.bit(), [0; 8]))?;
    let got = receive(&mut bus);
    assert_eq!(
        got.len(),
        2,
        "the wanted frame and the error frame: {got:?}"
    );
    assert_eq!(sender.counters().full, 0);
    assert_eq!(bus.health().state, BusState::BusOff);
    Ok(())
}

#[test]
fn a_receiver_that_sleeps_loses_the_newest_and_holds_nobody_up() -> Fallible {
    let directory = tempfile::tempdir()?;
    let mut awake = Bus::open(&spec(directory.path()), 0, Filter::All)?;
    let mut asleep = Bus::open(&spec(directory.path()), 1, Filter::All)?;
    let mut sender = Sender::open(&spec(directory.path()))?;
    let mut received = 0;
    for count in 0..200 {
        sender.send(&frame(0x100, &[count]))?;
        received += receive(&mut awake).len();
    }
    assert_eq!(received, 200);
    let queue: usize = std::fs::read_to_string("/proc/sys/net/unix/max_dgram_qlen")?
        .trim()
        .parse()?;
    let kept = receive(&mut asleep);
    assert!(
        kept.len() > queue.min(199),
        "{} kept, {queue} allowed",
        kept.len()
    );
    assert!(
        kept.iter()
            .zip(0..)
            .all(|(received, count)| received.frame.data() == [count]),
        "the oldest are kept"
    );
    assert_eq!(sender.counters().full, 200 - kept.len() as u64);
    Ok(())
}

#[test]
fn the_dead_are_buried_by_whoever_sends() -> Fallible {
    let directory = tempfile::tempdir()?;
    let mut bus = Bus::open(&spec(directory.path()), 0, Filter::All)?;
    let grave = directory.path().join("killed");
    drop(UnixDatagram::bind(&grave)?);
    let notes = directory.path().join("notes.txt");
    std::fs::write(&notes, "not a socket")?;
    let mut sender = Sender::open(&spec(directory.path()))?;
    sender.send(&frame(1, &[]))?;
    assert!(!grave.exists() && notes.exists());
    assert_eq!(sender.counters().buried, 1);
    assert_eq!(receive(&mut bus).len(), 1);
    drop(bus);
    let left: Vec<_> = std::fs::read_dir(directory.path())?
        .flatten()
        .map(|entry| entry.path())
        .collect();
    assert_eq!(left, [notes], "a bus leaves nothing behind");
    Ok(())
}

#[test]
fn the_dead_are_buried_by_whoever_comes_to_listen() -> Fallible {
    let directory = tempfile::tempdir()?;
    let living = Bus::open(&spec(directory.path()), 0, Filter::All)?;
    // What a process leaves that was killed: its socket, to which nobody listens.
    drop(UnixDatagram::bind(directory.path().join("1-0-0badcafe"))?);
    assert_eq!(std::fs::read_dir(directory.path())?.count(), 2);
    let newcomer = Bus::open(&spec(directory.path()), 0, Filter::All)?;
    assert_eq!(std::fs::read_dir(directory.path())?.count(), 2);
    let mut sender = Sender::open(&spec(directory.path()))?;
    sender.send(&frame(0x100, &[1]))?;
    for mut bus in [living, newcomer] {
        assert_eq!(receive(&mut bus).len(), 1);
    }
    Ok(())
}

#[test]
fn bytes_that_are_no_frame_are_counted_and_passed_over() -> Fallible {
    let directory = tempfile::tempdir()?;
    let mut bus = Bus::open(&spec(directory.path()), 0, Filter::All)?;
    let path = std::fs::read_dir(directory.path())?
        .next()
        .ok_or("no socket")??
        .path();
    let stranger = UnixDatagram::unbound()?;
    for bytes in [&[][..], &[1; 3], &[0xFF; 16], &[0xFF; 72], &[0; 1000]] {
        stranger.send_to(bytes, &path)?;
    }
    assert_eq!(receive(&mut bus), []);
    assert_eq!(
        (bus.health().counters.malformed, bus.health().state),
        (5, BusState::Up)
    );
    Ok(())
}

#[test]
fn a_flood_is_taken_in_portions() -> Fallible {
    let directory = tempfile::tempdir()?;
    let mut bus = Bus::open(&spec(directory.path()), 0, Filter::All)?;
    let mut sender = Sender::open(&spec(directory.path()))?;
    let mut received = 0;
    // Every frame taken lets another one in: without a bound this would never end.
    let drained = bus.receive(&mut |_| {
        received += 1;
        sender.send(&frame(1, &[])).unwrap();
    });
    assert_eq!((drained.frames, received), (0, 0));
    for _ in 0..8 {
        sender.send(&frame(1, &[]))?; // As many as one system call takes: fewer would mean that there are no more.
    }
    let drained = bus.receive(&mut |_| sender.send(&frame(1, &[])).unwrap());
    assert_eq!(
        (drained.frames, drained.more),
        (coloc_drivers::can::FRAMES_PER_CALL, true)
    );
    Ok(())
}

#[test]
fn a_bus_whose_directory_vanished_comes_back_with_it() -> Fallible {
    let directory = tempfile::tempdir()?;
    let place = directory.path().join("bus");
    let mut bus = Bus::open(&spec(&place), 0, Filter::All)?;
    let waited_on = rustix::fd::AsRawFd::as_raw_fd(&bus.as_fd());
    std::fs::remove_dir_all(&place)?;
    supervise(&mut bus, 1000, 101);
    assert_eq!(bus.health().state, BusState::Gone);
    supervise(&mut bus, 2000, 500);
    assert_eq!(
        (bus.health().state, bus.health().counters.reopened),
        (BusState::Gone, 0)
    );
    assert!(bus.health().counters.reopen_attempts >= 3);
    assert!(!readable(&bus), "what is gone wakes nobody");
    std::fs::create_dir(&place)?;
    supervise(&mut bus, 3000, 500);
    assert_eq!(
        (bus.health().state, bus.health().counters.reopened),
        (BusState::Up, 1)
    );
    assert_eq!(waited_on, rustix::fd::AsRawFd::as_raw_fd(&bus.as_fd()));
    Sender::open(&spec(&place))?.send(&frame(1, &[]))?;
    assert!(readable(&bus));
    assert_eq!(receive(&mut bus).len(), 1);
    Ok(())
}

#[test]
fn a_path_too_long_for_a_socket_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path().join("x".repeat(100));
    let refusal = Bus::open(&spec(&place), 0, Filter::All)
        .unwrap_err()
        .to_string();
    assert!(refusal.contains("can't open local:"), "{refusal}");
}

#[test]
fn a_directory_that_was_open_to_others_is_closed_and_one_for_other_things_refused() -> Fallible {
    let directory = tempfile::tempdir()?;
    let place = directory.path().join("bus");
    std::fs::create_dir(&place)?;
    let mode = |mode| std::fs::set_permissions(&place, std::fs::Permissions::from_mode(mode));
    mode(0o777)?;
    drop(Bus::open(&spec(&place), 0, Filter::All)?);
    assert_eq!(place.metadata()?.permissions().mode() & 0o777, 0o700);
    mode(0o777)?;
    std::fs::write(place.join("thesis.tex"), "years")?;
    for refusal in [
        Bus::open(&spec(&place), 0, Filter::All)
            .err()
            .map(|it| it.to_string()),
        Sender::open(&spec(&place)).err().map(|it| it.to_string()),
    ] {
        assert!(refusal.ok_or("not refused")?.contains("thesis.tex"));
    }
    Ok(())
}
