//! What the other user does. Whatever works is printed.
use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{self, Read};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};

use rustix::fs::FlockOperation;

use super::stage::{ACT, PLACES, READY};
use super::{group, shut};

pub(crate) fn act() {
    let places = std::env::var(PLACES).expect("started by a test");
    let places: Vec<_> = places.lines().map(Path::new).collect();
    match (
        std::env::var(ACT).expect("started by a test").as_str(),
        &*places,
    ) {
        ("everything", [site, socket]) => everything(site, socket),
        ("precreate", [place]) => precreate(place),
        ("link", [target, link]) => symlink(target, link).expect("a link"),
        ("copy", [from, to]) => copy(from, to),
        ("write", places) => places.iter().for_each(|place| write(place)),
        ("take the place of", places) => places.iter().for_each(|place| take_the_place_of(place)),
        ("open what is shut", [home]) => shut::open_all(home),
        ("make under a umask", [home]) => shut::make_under_a_umask(home),
        ("lock", [place]) => hold(place),
        ("try-lock", [place]) => println!("did: {:?}", lock(place)),
        ("read", [root]) => group::read(root),
        ("read of two", [root]) => group::read_of_two(root),
        ("read at a place", [root]) => group::read_at_a_place(root),
        ("take places", [root]) => group::take_places(root),
        ("knock", [door]) => group::knock(door),
        ("wait in vain", [root]) => group::wait_in_vain(root),
        ("fall asleep", [root]) => group::fall_asleep(root),
        ("break", files) => files.iter().for_each(|file| group::break_file(file)),
        ("crowd", [door]) => group::crowd(door),
        ("pretend", [page]) => group::pretend(page),
        (act, _) => panic!("no such act: {act}"),
    }
}

fn precreate(place: &Path) {
    fs::create_dir(place).expect("a directory");
    fs::create_dir(place.join("services")).expect("a directory");
    fs::set_permissions(place, Permissions::from_mode(0o777)).expect("a mode");
}

fn write(place: &Path) {
    fs::write(place, [0xA5; 4096]).expect("a file");
    fs::set_permissions(place, Permissions::from_mode(0o666)).expect("a mode");
}

fn take_the_place_of(place: &Path) {
    let mut attempts = with_file(place);
    attempts.retain(|(what, _)| !matches!(*what, "look at" | "move" | "remove"));
    report(place, attempts);
    let _ = fs::remove_file(place);
    write(place);
}

fn copy(from: &Path, to: &Path) {
    fs::copy(from, to).expect("a file");
    fs::set_permissions(to, Permissions::from_mode(0o644)).expect("a mode");
}

fn lock(place: &Path) -> io::Result<File> {
    let file = File::open(place)?;
    rustix::fs::flock(&file, FlockOperation::NonBlockingLockExclusive)?;
    Ok(file)
}

/// Until the test closes the other end.
fn hold(place: &Path) {
    let _file = lock(place).expect("a lock");
    println!("{READY}");
    let _ = io::stdin().read(&mut [0]);
}

fn everything(site: &Path, socket: &Path) {
    for directory in [site.join("shm"), site.join("bus")] {
        report(&directory, enter(&directory));
    }
    report(socket, with_socket(socket));
    let shared = fs::read_dir("/dev/shm").expect("everybody may").flatten();
    for path in shared
        .map(|entry| entry.path())
        .filter(|path| is_test(path))
    {
        report(&path, with_file(&path));
    }
    for name in ["key", "nodes", "services", "claims/robot1"] {
        let path = site.join("shm").join(name);
        report(&path, with_file(&path));
    }
}

fn is_test(path: &Path) -> bool {
    path.file_name()
        .is_some_and(|name| name.to_string_lossy().starts_with("strangers_"))
}

pub(crate) type Attempts = Vec<(&'static str, io::Result<()>)>;

pub(crate) fn report(path: &Path, attempts: Attempts) {
    for (what, result) in attempts {
        if result.is_ok() {
            println!("did: {what} {}", path.display());
        }
    }
}

fn enter(directory: &Path) -> Attempts {
    let planted = directory.join("planted");
    vec![
        ("list", fs::read_dir(directory).map(drop)),
        ("plant a file in", fs::write(&planted, "")),
        ("plant a directory in", fs::create_dir(&planted)),
        ("plant a link in", symlink("/", &planted)),
        ("lock", lock(directory).map(drop)),
        ("bind in", UnixDatagram::bind(&planted).map(drop)),
        (
            "open up",
            fs::set_permissions(directory, Permissions::from_mode(0o777)),
        ),
        ("move", fs::rename(directory, beside(directory))),
        ("remove", fs::remove_dir_all(directory)),
    ]
}

fn with_socket(socket: &Path) -> Attempts {
    let sender = UnixDatagram::unbound().expect("a socket");
    vec![
        ("send to", sender.send_to(&[0; 16], socket).map(drop)),
        ("remove", fs::remove_file(socket)),
    ]
}

pub(crate) fn with_file(path: &Path) -> Attempts {
    let open = |options: &mut OpenOptions| options.open(path).map(drop);
    vec![
        ("look at", path.metadata().and_then(|it| visible(path, &it))),
        ("read", open(OpenOptions::new().read(true))),
        ("write", open(OpenOptions::new().write(true))),
        ("lock", lock(path).map(drop)),
        ("link to", fs::hard_link(path, beside(path))),
        (
            "open up",
            fs::set_permissions(path, Permissions::from_mode(0o666)),
        ),
        ("move", fs::rename(path, beside(path))),
        ("remove", fs::remove_file(path)),
    ]
}

/// In `/dev/shm` everybody sees names and sizes; the administrator can prevent it (`docs/security.md`).
fn visible(path: &Path, _: &fs::Metadata) -> io::Result<()> {
    if path.starts_with("/dev/shm") {
        return Err(io::ErrorKind::PermissionDenied.into());
    }
    Ok(())
}

fn beside(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".taken");
    name.into()
}
