//! Private directories and own files, as seen by their owner; `strangers.rs` has the other side.
#![allow(clippy::unwrap_used, reason = "a test")]
use std::fs::{self, Permissions};
use std::io::{ErrorKind, Write};
use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
use std::path::{Path, PathBuf};

use coloc_shm_types::private::{NotPrivate, OwnFile, PrivateDirectory};

const LIMIT: u64 = 1000;

fn mode(path: &Path) -> u32 {
    fs::symlink_metadata(path).unwrap().mode() & 0o7777
}

fn chmod(path: &Path, mode: u32) {
    fs::set_permissions(path, Permissions::from_mode(mode)).unwrap();
}

fn make(path: &Path) -> Result<PrivateDirectory, NotPrivate> {
    PrivateDirectory::make(path, |name| name == "ours")
}

/// Somebody else's directory that everybody may enter, and where we may write if we are the superuser.
fn strangers(directory: &Path) -> Option<PathBuf> {
    if !rustix::process::geteuid().is_root() {
        println!("SKIPPED: a stranger's files, which only the superuser can give away");
        return None;
    }
    let path = directory.join("strangers");
    fs::create_dir(&path).unwrap();
    give_away(&path);
    Some(path)
}

fn give_away(path: &Path) {
    std::os::unix::fs::lchown(path, Some(65534), Some(65534)).unwrap();
}

#[test]
fn a_directory_is_made_for_its_owner_alone_with_those_above() {
    let temporary = tempfile::tempdir().unwrap();
    let path = temporary.path().join("a/b");
    let directory = make(&path).unwrap();
    assert_eq!(
        (mode(&path), mode(&temporary.path().join("a"))),
        (0o700, 0o700)
    );
    assert_eq!(directory.former_mode(), None);
    let below = directory.subdirectory("c").unwrap();
    assert_eq!(
        (below.path(), mode(below.path())),
        (&*path.join("c"), 0o700)
    );
    directory.subdirectory("c").unwrap();
}

#[test]
fn one_of_ours_that_is_open_is_closed_and_says_so() {
    for open in [0o755, 0o777, 0o1777, 0o750, 0o710] {
        let temporary = tempfile::tempdir().unwrap();
        fs::write(temporary.path().join("ours"), "").unwrap();
        chmod(temporary.path(), open);
        let directory = make(temporary.path()).unwrap();
        assert_eq!(
            (mode(temporary.path()), directory.former_mode()),
            (0o700, Some(open))
        );
        assert_eq!(make(temporary.path()).unwrap().former_mode(), None);
    }
}

#[test]
fn an_open_directory_for_other_things_is_refused_and_left_as_it_is() {
    let temporary = tempfile::tempdir().unwrap();
    fs::write(temporary.path().join("thesis.tex"), "years").unwrap();
    chmod(temporary.path(), 0o755);
    let refusal = make(temporary.path()).unwrap_err();
    assert!(refusal.to_string().contains("`thesis.tex`"), "{refusal}");
    assert_eq!(mode(temporary.path()), 0o755);
}

#[test]
fn what_a_stranger_put_into_an_open_directory_is_not_believed() {
    let temporary = tempfile::tempdir().unwrap();
    let Some(_) = strangers(temporary.path()) else {
        return;
    };
    let planted = temporary.path().join("ours");
    fs::write(&planted, "").unwrap();
    give_away(&planted);
    chmod(temporary.path(), 0o777);
    assert!(matches!(
        make(temporary.path()),
        Err(NotPrivate::Foreign { .. })
    ));
}

#[test]
fn a_directory_whose_place_others_could_take_is_refused() {
    let temporary = tempfile::tempdir().unwrap();
    let path = temporary.path().join("a");
    for (above, is_safe) in [
        (0o777, false),
        (0o1777, true),
        (0o755, true),
        (0o702, false),
    ] {
        chmod(temporary.path(), above);
        let result = make(&path);
        assert_eq!(result.is_ok(), is_safe, "below {above:o}: {result:?}");
    }
}

#[test]
fn a_strangers_directory_and_what_is_below_it_is_refused() {
    let temporary = tempfile::tempdir().unwrap();
    let Some(strangers) = strangers(temporary.path()) else {
        return;
    };
    assert!(matches!(
        make(&strangers),
        Err(NotPrivate::WrongUser {
            owner: 65534,
            own: 0,
            ..
        })
    ));
    let below = strangers.join("a");
    assert!(matches!(
        make(&below),
        Err(NotPrivate::StrangersParent { owner: 65534, .. })
    ));
    assert!(!below.exists());
}

#[test]
fn own_links_are_followed_and_a_strangers_are_not() {
    let temporary = tempfile::tempdir().unwrap();
    let [target, link] = ["target", "link"].map(|name| temporary.path().join(name));
    fs::create_dir(&target).unwrap();
    symlink("target", &link).unwrap();
    let resolved = temporary.path().canonicalize().unwrap().join("target");
    assert_eq!(make(&link).unwrap().path(), resolved);
    assert_eq!(
        make(&link.join("../link/b")).unwrap().path(),
        resolved.join("b")
    );
    let Some(_) = strangers(temporary.path()) else {
        return;
    };
    give_away(&link);
    chmod(temporary.path(), 0o1777);
    for path in [link.clone(), link.join("b")] {
        assert!(matches!(
            make(&path),
            Err(NotPrivate::StrangersLink { owner: 65534, .. })
        ));
    }
}

#[test]
fn a_ring_of_links_is_an_error() {
    let temporary = tempfile::tempdir().unwrap();
    symlink("b", temporary.path().join("a")).unwrap();
    symlink("a", temporary.path().join("b")).unwrap();
    assert!(matches!(
        make(&temporary.path().join("a")),
        Err(NotPrivate::System { .. })
    ));
}

#[test]
fn a_missing_directory_is_told_from_a_refusal() {
    let temporary = tempfile::tempdir().unwrap();
    let open = |name| PrivateDirectory::open(&temporary.path().join(name), |_| true);
    assert_eq!(open("a").unwrap_err().kind(), ErrorKind::NotFound);
    fs::write(temporary.path().join("file"), "").unwrap();
    assert!(matches!(
        open("file"),
        Err(NotPrivate::NotADirectory { .. })
    ));
}

#[test]
fn it_is_noticed_when_a_directory_is_deleted_or_exchanged() {
    let temporary = tempfile::tempdir().unwrap();
    let path = temporary.path().join("a");
    let directory = make(&path).unwrap();
    assert!(directory.is_in_place());
    fs::remove_dir(&path).unwrap();
    assert!(!directory.is_in_place());
    fs::create_dir(&path).unwrap();
    assert!(!directory.is_in_place());
}

#[test]
fn removing_follows_no_link() {
    let temporary = tempfile::tempdir().unwrap();
    let precious = temporary.path().join("precious");
    fs::create_dir(&precious).unwrap();
    fs::write(precious.join("thesis.tex"), "years").unwrap();
    let directory = make(&temporary.path().join("a")).unwrap();
    symlink(&precious, directory.path().join("link")).unwrap();
    fs::create_dir_all(directory.path().join("b/c")).unwrap();
    symlink(&precious, directory.path().join("b/c/link")).unwrap();
    fs::write(directory.path().join("b/file"), "").unwrap();
    for name in directory.entries().unwrap() {
        directory.remove(&name).unwrap();
    }
    directory.remove("gone".as_ref()).unwrap();
    assert_eq!(
        directory.entries().unwrap(),
        Vec::<std::ffi::OsString>::new()
    );
    assert!(precious.join("thesis.tex").exists());
}

/// The superuser could replace a device, for instance by saving to `/dev/null`.
#[test]
fn what_is_no_file_is_not_replaced() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("socket");
    let _socket = std::os::unix::net::UnixListener::bind(&path).unwrap();
    let refusal = OwnFile::named(&path).unwrap().replace(b"text").unwrap_err();
    assert!(matches!(refusal, NotPrivate::NotAFile { .. }), "{refusal}");
    assert!(!path.metadata().unwrap().is_file());
}

#[test]
fn a_file_is_replaced_whole_and_read_back() {
    let temporary = tempfile::tempdir().unwrap();
    let directory = make(temporary.path()).unwrap();
    let file = directory.file("belief.toml").unwrap();
    assert_eq!(file.read(LIMIT).unwrap(), None);
    // What a process that was killed meanwhile leaves.
    fs::write(temporary.path().join("belief.toml.new"), "half a fi").unwrap();
    for content in ["first", "second"] {
        file.replace(content.as_bytes()).unwrap();
        assert_eq!(file.read(LIMIT).unwrap().as_deref(), Some(content));
    }
    assert_eq!(mode(file.path()), 0o600);
    assert_eq!(directory.entries().unwrap(), ["belief.toml"]);
    assert!(matches!(
        file.read(3),
        Err(NotPrivate::TooLong { limit: 3, .. })
    ));
    file.remove().unwrap();
    file.remove().unwrap();
    assert_eq!(file.read(LIMIT).unwrap(), None);
}

#[test]
fn only_an_ordinary_file_of_ours_with_one_name_is_believed() {
    let temporary = tempfile::tempdir().unwrap();
    let path = temporary.path().join("belief.toml");
    let file = OwnFile::named(&path).unwrap();
    fs::write(&path, "text").unwrap();
    chmod(&path, 0o662);
    assert!(matches!(
        file.read(LIMIT),
        Err(NotPrivate::OpenFile { mode: 0o662, .. })
    ));
    chmod(&path, 0o644);
    assert_eq!(file.read(LIMIT).unwrap().as_deref(), Some("text"));
    fs::hard_link(&path, temporary.path().join("other")).unwrap();
    assert!(matches!(
        file.read(LIMIT),
        Err(NotPrivate::ManyNames { links: 2, .. })
    ));
    fs::remove_file(&path).unwrap();
    symlink("other", &path).unwrap();
    assert!(
        file.read(LIMIT).is_err(),
        "the link came after the file was looked for"
    );
    fs::remove_file(&path).unwrap();
    fs::create_dir(&path).unwrap();
    assert!(matches!(file.read(LIMIT), Err(NotPrivate::NotAFile { .. })));
}

#[test]
fn a_strangers_file_is_neither_read_nor_written() {
    let temporary = tempfile::tempdir().unwrap();
    let Some(_) = strangers(temporary.path()) else {
        return;
    };
    let path = temporary.path().join("belief.toml");
    fs::write(&path, "text").unwrap();
    give_away(&path);
    let file = OwnFile::named(&path).unwrap();
    assert!(matches!(
        file.read(LIMIT),
        Err(NotPrivate::WrongUser { .. })
    ));
    assert!(matches!(file.append(), Err(NotPrivate::WrongUser { .. })));
    assert!(matches!(
        file.read_write(),
        Err(NotPrivate::WrongUser { .. })
    ));
}

#[test]
fn a_log_is_added_to_and_may_be_an_own_link() {
    let temporary = tempfile::tempdir().unwrap();
    let [log, link] = ["colocd.log", "link"].map(|name| temporary.path().join(name));
    symlink("colocd.log", &link).unwrap();
    for _ in 0..2 {
        let file = OwnFile::named(&link).unwrap();
        file.append().unwrap().write_all(b"line\n").unwrap();
    }
    assert_eq!(fs::read_to_string(&log).unwrap(), "line\nline\n");
    assert_eq!(mode(&log), 0o600);
    let taken = OwnFile::named(&log).unwrap().create_new().unwrap_err();
    assert_eq!(taken.kind(), ErrorKind::AlreadyExists);
}

#[test]
fn a_link_that_a_stranger_put_in_the_place_of_a_log_is_refused() {
    let temporary = tempfile::tempdir().unwrap();
    let Some(_) = strangers(temporary.path()) else {
        return;
    };
    let [log, link] = ["precious", "link"].map(|name| temporary.path().join(name));
    fs::write(&log, "years").unwrap();
    symlink("precious", &link).unwrap();
    give_away(&link);
    chmod(temporary.path(), 0o1777);
    let refusal = OwnFile::named(&link).unwrap_err();
    assert!(matches!(
        refusal,
        NotPrivate::StrangersLink { owner: 65534, .. }
    ));
}

#[test]
fn devices_and_standard_error_will_do_as_logs() {
    for path in ["/dev/null", "/dev/stderr", "/proc/self/fd/2"] {
        let file = OwnFile::named(Path::new(path)).unwrap();
        file.append().unwrap().write_all(b"").unwrap();
    }
    assert!(matches!(
        OwnFile::named(Path::new("/dev/null")).unwrap().read(LIMIT),
        Err(NotPrivate::NotAFile { .. })
    ));
    assert!(OwnFile::named(Path::new("/")).is_err());
}

/// Nobody reads from it: opening it would wait for ever.
#[test]
fn a_pipe_without_a_reader_is_an_error_and_no_wait() {
    let temporary = tempfile::tempdir().unwrap();
    let path = temporary.path().join("pipe");
    rustix::fs::mkfifoat(rustix::fs::CWD, &path, rustix::fs::Mode::RWXU).unwrap();
    let file = OwnFile::named(&path).unwrap();
    assert!(file.append().is_err());
    assert!(matches!(file.read(LIMIT), Err(NotPrivate::NotAFile { .. })));
}
