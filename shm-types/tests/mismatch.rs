//! What a service that somebody else opened differently says.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use coloc_shm_types::{Estimate, Message, PortError, RobotName, Space};
use iceoryx2::node::Node;
use iceoryx2::prelude::{FileName, NodeBuilder, SemanticString, ZeroCopySend, ipc};

#[derive(Copy, Clone, Debug, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Estimate.v1")]
struct OldEstimate {
    pose: [f64; 32],
}

#[derive(Copy, Clone, Debug, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Estimate.v6")]
struct NewEstimate {
    pose: [f64; 46],
}

#[derive(Copy, Clone, Debug, ZeroCopySend)]
#[repr(C)]
#[type_name("geometry.Pose")]
struct Stranger {
    pose: [f64; 3],
}

/// The node of a program that goes its own way in the same space.
fn other_node(root: &Path, full_prefix: &str) -> Node<ipc::Service> {
    let mut config = iceoryx2::config::Config::default();
    let path = root.canonicalize().expect("a directory");
    let path =
        iceoryx2::prelude::Path::new(path.to_str().expect("text").as_bytes()).expect("short");
    config.global.set_root_path(&path);
    config.global.prefix = FileName::new(full_prefix.as_bytes()).expect("plain");
    NodeBuilder::new().config(&config).create().expect("a node")
}

/// How a port is refused where somebody has opened its service with the payload `T`.
fn refused_beside<T: ZeroCopySend + std::fmt::Debug + 'static>() -> PortError {
    let root = tempfile::tempdir().unwrap();
    let space = Space::open(root.path(), "t", "test").unwrap();
    let node = other_node(root.path(), space.middleware_prefix());
    let name = "coloc/r1/estimate".try_into().unwrap();
    let _service = node
        .service_builder(&name)
        .publish_subscribe::<T>()
        .create()
        .unwrap();
    let robot = RobotName::new("r1").unwrap();
    space.subscriber::<Estimate>(&robot).unwrap_err()
}

#[test]
fn another_version_of_a_payload_is_refused_in_words() {
    for (refusal, theirs, age) in [
        (
            refused_beside::<OldEstimate>(),
            "coloc.Estimate.v1",
            "an older",
        ),
        (
            refused_beside::<NewEstimate>(),
            "coloc.Estimate.v6",
            "a newer",
        ),
        (refused_beside::<Stranger>(), "geometry.Pose", "another"),
    ] {
        let PortError::OtherType {
            service,
            theirs: found,
            ..
        } = &refusal
        else {
            panic!("{refusal}");
        };
        assert_eq!(
            (service.as_str(), found.as_str()),
            ("coloc/r1/estimate", theirs)
        );
        let said = refusal.to_string();
        let expected = format!(
            "carries `{theirs}`, and this program speaks `coloc.Estimate.v5`: a program of {age} coloc uses"
        );
        assert!(
            said.contains(&expected) && said.contains("start them again"),
            "{said}"
        );
    }
}

/// Files whose names end so, by a second name of each that outlives the first.
fn kept(directory: &Path, prefix: &str, ending: &str) -> Vec<(PathBuf, PathBuf)> {
    let entries = std::fs::read_dir(directory).expect("a directory");
    let names = entries.map(|entry| entry.expect("an entry").file_name());
    names
        .filter_map(|name| name.into_string().ok())
        .filter(|name| name.starts_with(prefix) && name.ends_with(ending))
        .map(|name| {
            let (path, second) = (
                directory.join(&name),
                directory.join(format!("kept_{name}")),
            );
            std::fs::hard_link(&path, &second).expect("the same file system");
            (path, second)
        })
        .collect()
}

#[test]
fn another_version_that_died_meanwhile_is_in_nobodys_way() {
    let root = tempfile::tempdir().unwrap();
    let space = Space::open(root.path(), "t", "test").unwrap();
    let prefix = space.middleware_prefix();
    let node = other_node(root.path(), prefix);
    let name = "coloc/r1/estimate".try_into().unwrap();
    let service = node
        .service_builder(&name)
        .publish_subscribe::<OldEstimate>()
        .create()
        .unwrap();
    let mut halves = kept(&root.path().join("services"), prefix, ".service");
    halves.extend(kept(Path::new("/dev/shm"), prefix, ".dynamic"));
    assert_eq!(halves.len(), 2);
    drop((service, node));
    for ((path, kept), mode) in halves.into_iter().zip([0o400, 0o700]) {
        // It was made writable to be removed.
        std::fs::set_permissions(&kept, PermissionsExt::from_mode(mode)).unwrap();
        std::fs::rename(kept, path).unwrap();
    }
    space
        .subscriber::<Estimate>(&RobotName::new("r1").unwrap())
        .unwrap();
}

#[test]
fn another_quality_is_refused() {
    let root = tempfile::tempdir().unwrap();
    let space = Space::open(root.path(), "t", "test").unwrap();
    let node = other_node(root.path(), space.middleware_prefix());
    let name = "coloc/r1/estimate".try_into().unwrap();
    let _service = node
        .service_builder(&name)
        .publish_subscribe::<Estimate>()
        .create()
        .unwrap();
    let refusal = space
        .publisher::<Estimate>(&RobotName::new("r1").unwrap())
        .unwrap_err();
    assert!(
        matches!(refusal, PortError::OtherQuality { .. }),
        "{refusal}"
    );
}

#[test]
fn the_publisher_too_many_is_told_the_limit() {
    let root = tempfile::tempdir().unwrap();
    let space = Space::open(root.path(), "t", "test").unwrap();
    let robot = RobotName::new("r1").unwrap();
    let limit = Estimate::CHANNEL.quality().publishers;
    let _publishers: Vec<_> = (0..limit)
        .map(|_| space.publisher::<Estimate>(&robot).unwrap())
        .collect();
    let refusal = space.publisher::<Estimate>(&robot).unwrap_err();
    assert!(
        matches!(refusal, PortError::Full { limit: told, .. } if told == limit),
        "{refusal}"
    );
}
