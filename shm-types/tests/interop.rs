//! Programs that use iceoryx2's own service type, as those in other languages do, and ours: same names, same bytes.
use coloc_shm_types::{Channel, Estimate, Message, RobotName, Space};
use iceoryx2::node::Node;
use iceoryx2::prelude::{FileName, NodeBuilder, SemanticString, ipc};
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

fn robot() -> RobotName {
    RobotName::new("r1").expect("a name")
}

fn other_node(root: &std::path::Path, prefix: &str) -> Node<ipc::Service> {
    let mut config = iceoryx2::config::Config::default();
    let path = root.canonicalize().expect("a directory");
    let path =
        iceoryx2::prelude::Path::new(path.to_str().expect("text").as_bytes()).expect("short");
    config.global.set_root_path(&path);
    config.global.prefix = FileName::new(prefix.as_bytes()).expect("plain");
    NodeBuilder::new().config(&config).create().expect("a node")
}

fn other_service(node: &Node<ipc::Service>) -> PortFactory<ipc::Service, Estimate, ()> {
    let quality = Estimate::CHANNEL.quality();
    assert_eq!(Estimate::CHANNEL, Channel::Estimate);
    node.service_builder(&"coloc/r1/estimate".try_into().expect("a name"))
        .publish_subscribe::<Estimate>()
        .enable_safe_overflow(true)
        .max_publishers(quality.publishers)
        .max_subscribers(quality.subscribers)
        .max_nodes(quality.publishers + quality.subscribers)
        .subscriber_max_buffer_size(quality.buffer)
        .history_size(quality.history)
        .open_or_create()
        .expect("the service")
}

fn message(tick: u64) -> Estimate {
    Estimate {
        tick,
        ..Estimate::default()
    }
}

#[test]
fn what_we_open_they_can_use() {
    let root = tempfile::tempdir().unwrap();
    let space = Space::open(root.path(), "t", "test").unwrap();
    let publisher = space.publisher::<Estimate>(&robot()).unwrap();
    let subscriber = space.subscriber::<Estimate>(&robot()).unwrap();

    let node = other_node(root.path(), space.middleware_prefix());
    let service = other_service(&node);
    let their_subscriber = service.subscriber_builder().create().unwrap();
    let their_publisher = service.publisher_builder().create().unwrap();

    publisher.send(message(1)).unwrap();
    assert_eq!(their_subscriber.receive().unwrap().unwrap().tick, 1);
    while subscriber.receive().unwrap().is_some() {}
    their_publisher.send_copy(message(2)).unwrap();
    assert_eq!(subscriber.receive().unwrap().unwrap().tick, 2);
}

#[test]
fn what_they_open_we_can_use() {
    let root = tempfile::tempdir().unwrap();
    let space = Space::open(root.path(), "t", "test").unwrap();
    let node = other_node(root.path(), space.middleware_prefix());
    let service = other_service(&node);
    let their_subscriber = service.subscriber_builder().create().unwrap();
    let their_publisher = service.publisher_builder().create().unwrap();

    let publisher = space.publisher::<Estimate>(&robot()).unwrap();
    let subscriber = space.subscriber::<Estimate>(&robot()).unwrap();

    publisher.send(message(1)).unwrap();
    assert_eq!(their_subscriber.receive().unwrap().unwrap().tick, 1);
    while subscriber.receive().unwrap().is_some() {}
    their_publisher.send_copy(message(2)).unwrap();
    assert_eq!(subscriber.receive().unwrap().unwrap().tick, 2);
    assert_eq!(Space::waiting_connections(), 0);
}
