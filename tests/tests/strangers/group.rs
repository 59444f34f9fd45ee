//! Users of a group to which a robot is open, and one outside of it.
use std::fs;
use std::io::{self, Read};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use coloc_daemon::config::{Config, Scheduler, Shm};
use coloc_shm_types::{ReadError, Reader, RobotName, Space};
use rustix::fd::OwnedFd;
use rustix::mm::{MapFlags, MprotectFlags, ProtFlags, mmap, mprotect};
use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, connect, socket_with};
use rustix::process::Signal;

use super::stage::{Daemon, PATIENCE, READY, Stage, Staying, User, chmod, configuration};
use super::stranger::{report, with_file};

/// As many as there are connections.
const MANY: usize = 32;
/// Of a user.
const PLACES: usize = 8;

const GROUP: u32 = 60010;
const MEMBER: User = member(60001);
const OTHER_MEMBER: User = member(60002);
const OUTSIDER: User = User {
    id: 60003,
    group: 60011,
};

const fn member(id: u32) -> User {
    User { id, group: GROUP }
}

fn robot(name: &str) -> RobotName {
    RobotName::new(name).unwrap()
}

fn for_group(site: &Path) -> Config {
    let plain = configuration(site);
    Config {
        shm: Shm {
            group: GROUP.to_string(),
            ..plain.shm
        },
        ..plain
    }
}

/// What stands in `/dev/shm` of the robot at `site`, and ends so.
fn file(site: &Path, ending: &str) -> PathBuf {
    let space = Space::open(&site.join("shm"), "strangers", "test").unwrap();
    let entries = fs::read_dir("/dev/shm").unwrap();
    let mut paths = entries.map(|entry| entry.unwrap().path());
    paths
        .find(|path| {
            let path = path.to_string_lossy();
            path.contains(space.full_prefix()) && path.ends_with(ending)
        })
        .unwrap()
}

// What the other users do.

/// Looks, and sleeps for each of some estimates.
pub(crate) fn read(root: &Path) {
    let running = Space::running(root);
    println!("did: see {:?}", running.map(|all| all.len()));
    let reader = match Reader::open(root, &robot("robot1")) {
        Ok(reader) => reader,
        Err(refusal) => return println!("did: hear: {refusal}"),
    };
    let before = reader.wait(PATIENCE).unwrap().unwrap();
    for tick in 1..=20 {
        let estimate = reader.wait(PATIENCE).unwrap().unwrap();
        assert!(estimate.tick >= before.tick + tick);
    }
    assert!(reader.newest().unwrap().tick >= before.tick + 20);
    println!("did: read and wait");
}

/// The other one is not there.
pub(crate) fn read_of_two(root: &Path) {
    let refusal = Reader::open(root, &robot("robot2")).unwrap_err();
    assert!(matches!(refusal, ReadError::NotThere { .. }), "{refusal}");
    read(root);
}

/// Is rung for, and does not come back before it is asked to.
pub(crate) fn fall_asleep(root: &Path) {
    let reader = Reader::open(root, &robot("robot1")).unwrap();
    let before = reader.wait(PATIENCE).unwrap().unwrap();
    println!("{READY}");
    let _ = io::stdin().read(&mut [0]);
    let mut last = reader.wait(PATIENCE).unwrap().unwrap();
    assert!(last.tick > before.tick);
    for _ in 0..20 {
        let next = reader.wait(PATIENCE).unwrap().unwrap();
        assert!(next.tick > last.tick);
        last = next;
    }
    // Nobody listens any more to what the harness would say.
    std::process::exit(0);
}

/// Is woken by the robot, and not by a clock.
pub(crate) fn read_at_a_place(root: &Path) {
    let reader = Reader::open(root, &robot("robot1")).unwrap();
    take_place(&reader);
    read(root);
    assert!(reader.wait(PATIENCE).unwrap().is_some() && reader.has_place());
}

fn take_place(reader: &Reader) {
    let start = Instant::now();
    while !reader.has_place() {
        assert!(start.elapsed() < PATIENCE, "there is a place");
        reader.wait(PATIENCE).unwrap();
    }
}

/// Takes all that a user may have. Whoever has to give one away goes on.
pub(crate) fn take_places(root: &Path) {
    let name = robot("robot1");
    let readers: Vec<_> = (0..PLACES)
        .map(|_| Reader::open(root, &name).unwrap())
        .collect();
    readers.iter().for_each(take_place);
    println!("{READY}");
    let _ = io::stdin().read(&mut [0]);
    for reader in readers {
        let mut last = reader.wait(PATIENCE).unwrap().unwrap().tick;
        for _ in 0..5 {
            let next = reader.wait(PATIENCE).unwrap().unwrap().tick;
            assert!(next > last, "{next} after {last}");
            last = next;
        }
    }
    // Nobody listens any more to what the harness would say.
    std::process::exit(0);
}

/// As many as nobody has answered yet.
pub(crate) fn knock(door: &Path) {
    let address = SocketAddrUnix::new(door).unwrap();
    let _held: Vec<_> = std::iter::from_fn(|| connected(&address).ok()).collect();
    println!("{READY}");
    let _ = io::stdin().read(&mut [0]);
}

/// Longer than it may take until somebody is let in, and then like everybody.
pub(crate) fn wait_in_vain(root: &Path) {
    let reader = Reader::open(root, &robot("robot1")).unwrap();
    let before = reader.wait(PATIENCE).unwrap().unwrap();
    assert_eq!(reader.wait(Duration::from_millis(1500)).unwrap(), None);
    assert!(!reader.has_place());
    println!("{READY}");
    let _ = io::stdin().read(&mut [0]);
    take_place(&reader);
    assert!(reader.wait(PATIENCE).unwrap().unwrap().tick > before.tick);
    std::process::exit(0);
}

pub(crate) fn break_file(file: &Path) {
    report(file, with_file(file));
    report(file, vec![("map to write", map_to_write(file))]);
}

/// First as a reader does.
#[allow(unsafe_code, reason = "memory that is mapped")]
fn map_to_write(file: &Path) -> io::Result<()> {
    let file = fs::File::open(file)?;
    let place = std::ptr::null_mut();
    // SAFETY: the kernel chooses where, and nobody reads or writes it.
    let base = unsafe { mmap(place, 4096, ProtFlags::READ, MapFlags::SHARED, &file, 0)? };
    // SAFETY: as it was mapped.
    unsafe { mprotect(base, 4096, MprotectFlags::READ | MprotectFlags::WRITE) }?;
    Ok(())
}

/// Takes every connection that it gets, and never stops trying; they are watched by very many.
pub(crate) fn crowd(door: &Path) {
    let address = SocketAddrUnix::new(door).unwrap();
    let mut held = Vec::new();
    while held.len() < MANY {
        held.extend(connected(&address));
    }
    let crowd = held.iter().flat_map(watched);
    let _crowd: Vec<_> = crowd.collect();
    println!("{READY}");
    loop {
        // Let go at once.
        let _ = connected(&address);
    }
}

fn connected(address: &SocketAddrUnix) -> rustix::io::Result<OwnedFd> {
    let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
    let socket = socket_with(AddressFamily::UNIX, SocketType::SEQPACKET, flags, None)?;
    connect(&socket, address)?;
    Ok(socket)
}

fn watched(socket: &OwnedFd) -> Vec<OwnedFd> {
    use rustix::event::epoll;
    let watch = |_| {
        let watch = epoll::create(epoll::CreateFlags::CLOEXEC).unwrap();
        let data = epoll::EventData::new_u64(0);
        let added = epoll::add(&watch, socket, data, epoll::EventFlags::IN);
        added.unwrap();
        watch
    };
    (0..20).map(watch).collect()
}

/// Puts something beside a page that looks like another robot's.
pub(crate) fn pretend(page: &Path) {
    let name = page.to_str().unwrap().replace("robot1", "robot2");
    let door = page.to_str().unwrap().replace(".robot1.page", ".door");
    assert!(Path::new(&door).exists());
    fs::write(&name, [0; 4096]).unwrap();
    fs::set_permissions(&name, std::os::unix::fs::PermissionsExt::from_mode(0o640)).unwrap();
    println!("did: {name}");
}

// What comes of it.

#[test]
fn members_read_and_wait_and_an_outsider_is_told_what_to_do() {
    let Some(stage) = Stage::new() else { return };
    for (umask, mode) in [("000", 0o755), ("022", 0o700), ("077", 0o700)] {
        let site = stage.site(0);
        let daemon = Daemon::start_with(&site, umask, &for_group(&site));
        daemon.listen();
        // Behind a directory that nobody else may enter as well.
        chmod(&site, mode);
        let root = site.join("shm");
        for user in [MEMBER, OTHER_MEMBER] {
            let done = stage.user(user, "read", &[&root]);
            assert_eq!(done, "see Ok(1)\nread and wait", "umask {umask}");
        }
        let done = stage.user(OUTSIDER, "read", &[&root]);
        let sentence = "user 60003 may not read robot1, the group 60010 may: as the superuser add that user to it \
                        (usermod -aG 60010 USER), then log in again";
        assert!(done.ends_with(&format!("hear: {sentence}")), "{done}");
        assert_eq!(root.metadata().unwrap().mode() & 0o777, 0o700);
        daemon.terminate();
    }
}

#[test]
fn where_no_group_is_configured_nobody_else_reads() {
    let Some(stage) = Stage::new() else { return };
    let site = stage.site(0);
    let daemon = Daemon::start(&site, "022");
    daemon.listen();
    let done = stage.user(MEMBER, "read", &[&site.join("shm")]);
    assert!(
        done.contains("belongs to user 0, who lets no other user read there")
            && done.contains("`group` in [shm]"),
        "{done}"
    );
    daemon.terminate();
}

#[test]
fn a_member_can_look_and_nothing_else() {
    let Some(stage) = Stage::new() else { return };
    let site = stage.site(0);
    let daemon = Daemon::start_with(&site, "022", &for_group(&site));
    daemon.listen();
    let (page, door, key) = (
        file(&site, ".page"),
        file(&site, ".door"),
        site.join("shm/key"),
    );
    let files = [&*page, &*door, &*key];
    // A lock on the page is nobody's concern: see below.
    let looked = ["read", "lock"].map(|what| format!("{what} {}", page.display()));
    assert_eq!(stage.user(MEMBER, "break", &files), looked.join("\n"));
    assert_eq!(stage.user(OUTSIDER, "break", &files), "");
    for directory in ["", "claims", "nodes", "services"] {
        let directory = site.join("shm").join(directory);
        let done = stage.user(MEMBER, "try-lock", &[&directory]);
        assert!(done.contains("Permission denied"), "{done}");
    }
    let locks = stage.user_stays(MEMBER, "lock", &[&page]);
    daemon.listen();
    assert!(
        stage
            .user(OTHER_MEMBER, "read", &[&site.join("shm")])
            .contains("read and wait")
    );
    daemon.terminate();
    let again = Daemon::start_with(&site, "022", &for_group(&site));
    again.listen();
    again.terminate();
    drop(locks);
}

#[test]
fn a_member_that_is_stopped_costs_nobody_anything_and_is_woken_again() {
    let Some(stage) = Stage::new() else { return };
    let site = stage.site(0);
    let root = site.join("shm");
    let daemon = Daemon::start_with(&site, "022", &for_group(&site));
    daemon.listen();
    let mut sleeper = stage.user_stays(MEMBER, "fall asleep", &[&root]);
    sleeper.signal(Signal::STOP);
    // Many more than its connection holds.
    for _ in 0..3 {
        let done = stage.user(OTHER_MEMBER, "read", &[&root]);
        assert!(done.contains("read and wait"), "{done}");
        daemon.listen();
    }
    sleeper.signal(Signal::CONT);
    sleeper.ends_well();
    daemon.terminate();
}

#[test]
fn a_member_that_comes_again_and_again_shuts_nobody_out() {
    let Some(stage) = Stage::new() else { return };
    let site = stage.site(0);
    let root = site.join("shm");
    let daemon = Daemon::start_with(&site, "022", &for_group(&site));
    daemon.listen();
    let door = file(&site, ".door");
    let crowds = [MEMBER, member(60020), member(60021), member(60022)]
        .map(|user| stage.user_stays(user, "crowd", &[&door]));
    let first = daemon.listen().tick;
    for _ in 0..3 {
        assert!(
            stage
                .user(OTHER_MEMBER, "read", &[&root])
                .contains("read and wait")
        );
    }
    assert!(daemon.listen().tick >= first + 60, "it ticks on");
    drop(crowds);
    let start = Instant::now();
    while !stage
        .user(MEMBER, "read", &[&root])
        .contains("read and wait")
    {
        assert!(start.elapsed() < PATIENCE, "the places were given back");
        std::thread::sleep(Duration::from_millis(10));
    }
    daemon.terminate();
}

#[test]
fn members_that_have_all_places_give_one_to_who_has_none() {
    let Some(stage) = Stage::new() else { return };
    let site = stage.site(0);
    let root = site.join("shm");
    let daemon = Daemon::start_with(&site, "022", &for_group(&site));
    daemon.listen();
    let all = (0..MANY / PLACES).map(|number| member(60020 + u32::try_from(number).unwrap()));
    let mut all: Vec<_> = all
        .map(|user| stage.user_stays(user, "take places", &[&root]))
        .collect();
    for user in [OTHER_MEMBER, MEMBER] {
        let done = stage.user(user, "read at a place", &[&root]);
        assert!(done.contains("read and wait"), "{done}");
    }
    all.iter_mut().for_each(Staying::ends_well);
    daemon.terminate();
}

/// The next wake-up but one is not to be that of an ordinary thread.
#[test]
fn who_wakes_the_members_is_in_real_time_behind_the_tick() {
    let Some(stage) = Stage::new() else { return };
    let site = stage.site(0);
    let mut config = for_group(&site);
    config.realtime.scheduler = Scheduler::Fifo;
    let daemon = Daemon::start_with(&site, "022", &config);
    daemon.listen();
    let (class, priority) = daemon.schedule_of("colocd-tick");
    if priority == 0 {
        eprintln!("SKIPPED: a thread in real time, which is refused here");
        return;
    }
    let start = Instant::now();
    let comes_next = || daemon.schedule_of("coloc-porter") == (class, priority - 1);
    while !comes_next() {
        assert!(start.elapsed() < PATIENCE, "it is told right after");
        std::thread::sleep(Duration::from_millis(1));
    }
    daemon.terminate();
}

/// As on a machine that is so busy that the door is not answered.
#[test]
fn who_is_not_answered_at_the_door_waits_and_is_not_turned_away() {
    let Some(stage) = Stage::new() else { return };
    let site = stage.site(0);
    let daemon = Daemon::start_with(&site, "022", &for_group(&site));
    daemon.listen();
    let door = file(&site, ".door");
    daemon.stop();
    let many = stage.user_stays(MEMBER, "knock", &[&door]);
    let mut waits = stage.user_stays(OTHER_MEMBER, "wait in vain", &[&site.join("shm")]);
    daemon.go_on();
    waits.ends_well();
    drop(many);
    daemon.terminate();
}

#[test]
fn what_a_stranger_puts_beside_the_page_is_not_believed() {
    let Some(stage) = Stage::new() else { return };
    let site = stage.site(0);
    let daemon = Daemon::start_with(&site, "022", &for_group(&site));
    daemon.listen();
    let planted = stage.user(OTHER_MEMBER, "pretend", &[&file(&site, ".page")]);
    let done = stage.user(MEMBER, "read of two", &[&site.join("shm")]);
    assert_eq!(done, "see Ok(1)\nread and wait");
    daemon.terminate();
    fs::remove_file(planted).unwrap();
}

#[test]
fn who_is_not_in_the_group_cannot_open_a_robot_to_it() {
    let Some(stage) = Stage::new() else { return };
    let home = stage.home();
    let owner = home.metadata().unwrap().uid();
    let user = User {
        id: owner,
        group: owner,
    };
    let said = stage
        .daemon_of(user, &home, "022", &for_group(&home))
        .refuses();
    let sentence = "colocd: shm.group: user 65534, who runs this, is not in the group 60010";
    assert!(
        said.contains(sentence) && said.contains("usermod -aG 60010"),
        "{said}"
    );
    let user = User {
        id: owner,
        group: GROUP,
    };
    let daemon = stage.daemon_of(user, &home, "077", &for_group(&home));
    let start = Instant::now();
    while !stage
        .user(MEMBER, "read", &[&home.join("shm")])
        .contains("read and wait")
    {
        assert!(start.elapsed() < PATIENCE, "{}", daemon.said());
    }
    daemon.terminate();
}

#[test]
fn a_group_that_nobody_knows_is_no_group() {
    let Some(stage) = Stage::new() else { return };
    let site = stage.site(0);
    let mut config = for_group(&site);
    config.shm.group = "no-such-group".into();
    let said = Daemon::start_with(&site, "022", &config).refuses();
    assert!(
        said.contains("shm.group: there is no group `no-such-group` on this computer"),
        "{said}"
    );
}
