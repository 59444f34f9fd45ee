//! Those who listen and lie: with a key of nobody's, with one whose time is over, and with a member's own.
#![allow(clippy::unwrap_used)] // A test may panic.

mod support;

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use coloc_link::engine::{Engine, Line};
use coloc_link::keys::{Identity, PublicKey};
use coloc_link::kinds::Kind;
use coloc_link::roster::{Moment, Role, fingerprint};
use coloc_link::tls::Members;
use coloc_link::wire::{self, ClockWord, Envelope, Hello, seal, word};
use coloc_shm_types::{Channel, Clock, Header, Neighbour, Plain, Publisher, Sender, Subscriber};
use support::{Site, all, free_address, member, name, roster, until, wall_ns};

const HONEST: u16 = 2;
const LATE: u16 = 3;
const LIAR: u16 = 4;
const NOBODY: u16 = 77;

#[derive(Debug)]
struct Anybody;

impl Members for Anybody {
    fn admits(&self, _: &PublicKey) -> bool {
        true
    }
}

/// Who has a key, and says with it what it likes.
struct Liar {
    key: Identity,
    session: u64,
    sequence: u64,
}

impl Liar {
    fn with_key_of(id: u16) -> Self {
        Self {
            key: Identity::insecure(id),
            session: u64::from(id),
            sequence: 0,
        }
    }

    fn sealed_as(&mut self, speaker: u16, kind: u32, body: &[u8]) -> Vec<u8> {
        self.sequence += 1;
        let envelope = Envelope {
            version: wire::NEWEST,
            team: Identity::insecure(0).public().team(),
            session: self.session,
            sequence: self.sequence,
            stamp_ns: wall_ns(),
            kind,
            roster: 1,
            speaker,
            receiver: 1,
        };
        let mut bytes = Vec::new();
        assert!(seal(&envelope, body, self.key.signing(), &mut bytes));
        bytes
    }

    /// What a member says first, so that it is heard.
    fn greeting_as(&mut self, speaker: u16) -> Vec<Vec<u8>> {
        let hello = Hello {
            oldest: wire::OLDEST,
            newest: wire::NEWEST,
            flags: 0,
            datum: fingerprint("hall"),
            periods: fingerprint(""),
            kinds: Vec::new(),
            ..Hello::default()
        };
        let now_ns = wall_ns();
        let clock = ClockWord {
            echo_ns: now_ns - 2_000_000,
            heard_ns: now_ns - 1_000_000,
        };
        vec![
            self.sealed_as(speaker, word::HELLO, &hello.body()),
            self.sealed_as(speaker, word::CLOCK, &clock.body()),
        ]
    }

    /// A pose for robot 1, whose payload names `source`.
    fn pose_as(&mut self, speaker: u16, source: u16) -> Vec<u8> {
        let told = Neighbour {
            header: Header {
                stamp_ns: wall_ns(),
                source,
                clock: Clock::Realtime as u8,
                sequence: self.sequence,
                ..Header::default()
            },
            ..Neighbour::default()
        };
        let mut body = [0; Neighbour::BYTES];
        assert!(told.put(&mut body).is_some());
        self.sealed_as(speaker, Kind::of(Channel::Neighbour).code, &body)
    }

    /// Calls, and says all of that, one after another; whether it was listened to until the end.
    fn say(&self, to: SocketAddr, messages: &[Vec<u8>]) -> bool {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .unwrap();
        runtime.block_on(async {
            let members: Arc<dyn Members> = Arc::new(Anybody);
            let own = SocketAddr::from(([127, 0, 0, 1], 0));
            let engine = Engine::open(own, &self.key, &members).unwrap();
            let Ok(line) = engine.call(to).await else {
                return false;
            };
            let heard = say_all(&line, messages).await;
            engine.close().await;
            heard
        })
    }
}

async fn say_all(line: &Line, messages: &[Vec<u8>]) -> bool {
    for message in messages {
        if !line.send_stream(message, Duration::from_secs(20)).await {
            return false;
        }
    }
    true
}

/// Robot 1, whom all want to tell something, and robot 2, who may.
struct Scene {
    sites: [Site; 2],
    voice: Publisher<Neighbour>,
    sender: Sender,
    ear: Subscriber<Neighbour>,
    address: SocketAddr,
}

impl Scene {
    fn new(home: &Path) -> Self {
        let address = free_address();
        let listens = free_address();
        let mut late = member(LATE, Role::Robot, None);
        late.expires = Moment::of_ns(wall_ns()).later(-1);
        let members = vec![
            member(1, Role::Robot, Some(address)),
            member(HONEST, Role::Robot, Some(listens)),
            late,
            member(LIAR, Role::Robot, None),
        ];
        let text = roster(1, members);
        let mut sites = [
            Site::new(home, 1, address),
            Site::new(home, HONEST, listens),
        ];
        for site in &mut sites {
            site.start(&text);
        }
        Self {
            voice: sites[1].space.publisher(&name(1)).unwrap(),
            sender: Sender::start(HONEST, Clock::Realtime).unwrap(),
            ear: sites[0].space.subscriber(&name(1)).unwrap(),
            sites,
            address,
        }
    }

    /// Until robot 2 is heard again; everything that robot 1 heard meanwhile.
    fn honest_is_heard(&mut self) -> Vec<Neighbour> {
        let (voice, sender, ear) = (&self.voice, &mut self.sender, &self.ear);
        let mut heard = Vec::new();
        until(
            "robot 2 is heard",
            || {
                let header = sender.header(wall_ns());
                voice
                    .send(Neighbour {
                        header,
                        ..Neighbour::default()
                    })
                    .unwrap();
            },
            || {
                heard.extend(all(ear));
                heard
                    .iter()
                    .any(|it| it.header.source == HONEST)
                    .then_some(())
            },
        );
        heard
    }
}

#[test]
fn who_has_no_members_key_reaches_nothing() {
    let home = tempfile::tempdir().unwrap();
    let mut scene = Scene::new(home.path());
    scene.honest_is_heard();
    for (key, speaker) in [(NOBODY, NOBODY), (NOBODY, HONEST), (LATE, LATE)] {
        let mut liar = Liar::with_key_of(key);
        let mut messages = liar.greeting_as(speaker);
        messages.push(liar.pose_as(speaker, speaker));
        assert!(!liar.say(scene.address, &messages));
        let heard = scene.honest_is_heard();
        assert!(heard.iter().all(|it| it.header.source == HONEST));
    }
    assert_eq!(scene.sites[0].id, 1);
}

#[test]
fn a_member_speaks_for_itself_alone_and_says_everything_once() {
    let home = tempfile::tempdir().unwrap();
    let mut scene = Scene::new(home.path());
    scene.honest_is_heard();
    let mut liar = Liar::with_key_of(LIAR);
    let mut messages = liar.greeting_as(LIAR);
    let good = liar.pose_as(LIAR, LIAR);
    let mut flipped = liar.pose_as(LIAR, LIAR);
    flipped[100] ^= 1;
    let earlier = Liar {
        session: 1,
        ..Liar::with_key_of(LIAR)
    }
    .pose_as(LIAR, LIAR);
    messages.extend([
        liar.pose_as(HONEST, HONEST),
        liar.pose_as(LIAR, HONEST),
        flipped,
        earlier,
        b"noise".to_vec(),
        good.clone(),
        good.clone(),
        good,
    ]);
    // It is a member: so it is listened to, and of all of that one message is said.
    assert!(liar.say(scene.address, &messages));
    let mut heard = Vec::new();
    let mut rounds = 0;
    while rounds < 20 || !heard.iter().any(|it: &Neighbour| it.header.source == LIAR) {
        heard.extend(scene.honest_is_heard());
        rounds += 1;
        assert!(rounds < 2000, "the good message never came");
    }
    let of_liar = heard.iter().filter(|it| it.header.source == LIAR).count();
    assert_eq!(of_liar, 1);
    let honest = heard.iter().filter(|it| it.header.source == HONEST);
    let session = scene.sender.session();
    assert!(honest.clone().count() > 0 && honest.clone().all(|it| it.header.session == session));
}
