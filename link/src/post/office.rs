//! What all tasks of a link share.
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;

use coloc_daemon::config::Config;
use coloc_sensors::status::Reporter;
use coloc_sensors::teller::Teller;
use coloc_sensors::{EndError, Moment as Present};
use coloc_shm_types::{Age, Channel, Claim, RobotName, Space};

use super::company::Wanted;
use super::counts::Counts;
use super::lines::Member;
use super::motion::Motion;
use super::rosters::Team;
use crate::admission::{Admission, Now, Rules, own_hello};
use crate::discovery::{Announced, Found};
use crate::engine::{Door, Vitals};
use crate::keys::Identity;
use crate::kinds::Kind;
use crate::roster::{Book, FLEET, Role, Roster, fingerprint};
use crate::section::Link;
use crate::space::Mouth;
use crate::wire::{Envelope, Versions, seal, word};
use crate::wrong_clock::WrongClock;

const NAME: &str = "coloc-link";
const DRIVER: &str = "link";

/// What all tasks of a link share.
#[derive(Debug)]
pub struct Office {
    pub(super) section: Link,
    pub(super) space: Space,
    pub(super) root: PathBuf,
    pub(super) own: u16,
    pub(super) name: RobotName,
    pub(super) identity: Rc<Identity>,
    pub(super) book: Book,
    pub(super) team: Arc<Team>,
    pub(super) admission: Admission,
    pub(super) motion: Motion,
    pub(super) members: BTreeMap<u16, Member>,
    pub(super) counts: Counts,
    pub(super) wanted: Wanted,
    pub(super) found: Found,
    pub(super) teller: Teller,
    /// Numbers of the robots in `[[team]]`, to which alone the robot's programs speak; none: to everybody.
    pub(super) listed: Vec<u16>,
    /// Robots that are in the own space, as it was last looked.
    pub(super) local: Vec<String>,
    /// Whose channels are listened to already.
    pub(super) heard: Vec<(RobotName, Channel)>,
    /// When it began (ns of `CLOCK_BOOTTIME`).
    pub(super) started_ns: i64,
    /// What others see of the own clock.
    pub(super) clock: WrongClock,
    pub(super) rules: Rules,
    pub(super) session: u64,
    pub(super) sequences: BTreeMap<u32, u64>,
    pub(super) mouths: BTreeMap<(u16, u32), Mouth>,
    pub(super) reporter: Reporter,
    /// Two links of one robot would carry everything twice.
    _claim: Claim,
    /// The robot's own directory.
    pub(super) directory: PathBuf,
    pub(super) fleet: PathBuf,
    pub(super) fleet_text: String,
    pub(super) door: Door,
    pub(super) opened: u64,
    /// Of connections that are over.
    pub(super) past: Vitals,
    /// The last that was known of each member, by name.
    pub(super) last: BTreeMap<String, String>,
}

/// What an office is opened with.
#[derive(Debug)]
pub struct Papers {
    /// `robot.toml`.
    pub config: Config,
    /// Its `[link]`.
    pub section: Link,
    /// The robot's own directory.
    pub directory: PathBuf,
    /// The robot's key.
    pub identity: Identity,
    /// The newest roster that it has.
    pub book: Book,
    /// [`fingerprint`] of the configured `[gnss.datum]`; 0: none is.
    pub origin: u64,
    /// Which versions of the format it speaks.
    pub versions: Versions,
}

pub(super) fn now() -> Now {
    let present = Present::now();
    Now {
        wall_ns: present.realtime_ns,
        boot_ns: present.boottime_ns,
    }
}

/// By how much a stamp may be ahead of the own clock, beside what is not known of the other (ns): as a tick's deadline may be.
const AHEAD_NS: i64 = 50_000_000;

impl Office {
    /// Enters the robot's shared memory.
    ///
    /// # Errors
    /// If the robot is not in the roster under its name, number and key, or shared memory cannot be entered.
    pub fn open(papers: Papers) -> Result<Self, EndError> {
        let Papers {
            config,
            section,
            directory,
            identity,
            book,
            origin,
            versions,
        } = papers;
        let (own, name) = (config.robot.id, config.robot.name.clone());
        check_own(book.roster(), own, &name, &identity)?;
        let space = config.open_space(NAME)?;
        let roster = Arc::new(book.roster().clone());
        let rules = Rules {
            origin,
            versions,
            ..rules(&config, &section, &roster)
        };
        let team = Arc::new(Team::of(roster, own));
        Ok(Self {
            root: config.shm_root()?.path,
            _claim: space.claim_driver(&name, DRIVER, own)?,
            motion: Motion::open(&space, &name)?,
            reporter: Reporter::open(&space, &name, DRIVER, own)?,
            space,
            own,
            name,
            identity: Rc::new(identity),
            fleet_text: book.text().into(),
            fleet: directory.join(FLEET),
            directory,
            book,
            team,
            admission: Admission::new(rules.clone()),
            rules,
            members: BTreeMap::new(),
            counts: Counts::default(),
            wanted: Wanted::default(),
            found: Found::default(),
            teller: Teller::new(NAME),
            listed: config.team.iter().map(|it| it.id).collect(),
            local: Vec::new(),
            heard: Vec::new(),
            started_ns: now().boot_ns,
            session: coloc_shm_types::private::unguessable()
                .map_err(EndError::of("there are no random numbers"))?,
            sequences: BTreeMap::new(),
            mouths: BTreeMap::new(),
            door: Door::default(),
            opened: 0,
            past: Vitals::default(),
            last: BTreeMap::new(),
            section,
            clock: WrongClock::default(),
        })
    }

    /// Shows others this clock instead of the own.
    #[must_use]
    pub fn with_clock(self, clock: WrongClock) -> Self {
        Self { clock, ..self }
    }

    /// The present by the clock that others see.
    pub(super) fn shown_now(&self) -> Now {
        let now = now();
        Now {
            wall_ns: self.clock.shows(now.wall_ns),
            ..now
        }
    }

    pub(super) fn team(&self) -> Arc<Team> {
        Arc::clone(&self.team)
    }

    pub(super) const fn versions(&self) -> Versions {
        self.rules.versions
    }

    pub(super) fn listens_on(&self) -> SocketAddr {
        self.section.address()
    }

    pub(super) fn identity(&self) -> &Identity {
        &self.identity
    }

    pub(super) fn begin(&mut self, door: Door, address: Option<SocketAddr>) {
        self.door = door;
        let address = address.map_or_else(|| self.section.listen.clone(), |it| it.to_string());
        let members = self.book.roster().member.len();
        let name = &self.book.roster().name;
        let text = format!(
            "{} of the team {name}, {members} members, listens on {address}",
            self.name
        );
        self.teller.remark(text);
    }

    pub(super) fn roster(&self) -> Arc<Roster> {
        self.team.newest()
    }

    /// Whether the robot may speak at all.
    pub(super) fn speaks(&self) -> bool {
        let roster = self.book.roster();
        roster
            .member(self.own)
            .is_some_and(|own| own.role == Role::Robot)
    }

    /// How old messages of a kind may get (ns).
    pub(super) fn oldest_ns(&self, kind: &Kind) -> i64 {
        match kind.told.age {
            Age::History => self.rules.history_ns,
            Age::Millis(millis) => i64::from(millis) * 1_000_000,
        }
    }

    /// A message of the own robot, sealed in the newest version that the receiver understands too; `None` if there is none, or it has not
    /// said.
    pub(super) fn seal(&mut self, kind: u32, receiver: u16, body: &[u8]) -> Option<Vec<u8>> {
        let hello = self
            .admission
            .peer(receiver)
            .and_then(crate::admission::Peer::hello)?;
        let version = hello.common_version(self.rules.versions)?;
        self.seal_in(version, kind, receiver, body)
    }

    fn seal_in(&mut self, version: u8, kind: u32, receiver: u16, body: &[u8]) -> Option<Vec<u8>> {
        let stamp_ns = self.shown_now().wall_ns;
        let sequence = self.sequences.entry(kind).or_default();
        let envelope = Envelope {
            version,
            team: self.book.team().team(),
            session: self.session,
            sequence: *sequence,
            stamp_ns,
            kind,
            roster: self.book.roster().version,
            speaker: self.own,
            receiver,
        };
        *sequence += 1;
        self.counts.signed += 1;
        let mut message = Vec::new();
        seal(&envelope, body, self.identity.signing(), &mut message).then_some(message)
    }

    /// What a new connection begins with: the same in every version, since it is not known yet which of them are understood there.
    pub(super) fn hello(&mut self, receiver: u16) -> Vec<Vec<u8>> {
        let body = own_hello(&self.rules, self.book.roster(), self.shown_now()).body();
        let Versions { oldest, newest } = self.rules.versions;
        let versions = oldest..=newest;
        let sealed = versions.map(|it| self.seal_in(it, word::HELLO, receiver, &body));
        sealed.collect::<Vec<_>>().into_iter().flatten().collect()
    }

    /// Says in shared memory what a member has said: for this robot on its own channel, else on the member's.
    pub(super) fn say(&mut self, speaker: u16, kind: &Kind, bytes: &[u8]) {
        let key = (speaker, kind.code);
        if !self.mouths.contains_key(&key) {
            let roster = self.team.newest();
            let robot = if kind.is_for_one() {
                Some(&self.name)
            } else {
                roster.member(speaker).map(|member| &member.name)
            };
            let opened = robot.map(|robot| Mouth::open(&self.space, robot, kind.told.channel));
            match opened {
                Some(Ok(mouth)) => {
                    self.mouths.insert(key, mouth);
                }
                Some(Err(error)) => self.teller.remark(error.to_string()),
                None => {}
            }
        }
        let said = self.mouths.get(&key).is_some_and(|mouth| mouth.say(bytes));
        if said {
            self.counts.said += 1;
        } else {
            self.counts.no_reader += 1;
        }
    }

    /// Somebody announces itself, perhaps a member.
    pub(super) fn found(&mut self, announced: &Announced) {
        let (roster, team) = (self.team.newest(), self.book.team().team());
        let is_new = self.found.take(announced, team, self.own, &roster);
        self.counts.announced_by_strangers = self.found.strangers();
        if let (true, Some(member)) = (is_new, roster.member(announced.id)) {
            let places = announced.addresses.iter().map(ToString::to_string);
            let places = places.collect::<Vec<_>>().join(", ");
            let text = format!("{} announces itself at {places}", member.name);
            self.teller.remark(text);
        }
    }
}

fn check_own(
    roster: &Roster,
    id: u16,
    name: &RobotName,
    identity: &Identity,
) -> Result<(), EndError> {
    let own = roster.member(id).filter(|own| own.name == *name);
    let problem = match own {
        None => {
            format!("robot {id}, {name}, is not in the roster: add it with `coloc-link fleet add`")
        }
        Some(own) if !own.has(&identity.public()) => {
            format!(
                "the roster has another key of {name} than its directory: `coloc-link fleet renew` it"
            )
        }
        Some(_) => return Ok(()),
    };
    Err(EndError::Input(problem))
}

fn rules(config: &Config, section: &Link, roster: &Roster) -> Rules {
    #[expect(clippy::cast_possible_truncation, reason = "to whole nanoseconds")]
    let history_ns = (config.history.length_s * 1e9) as i64;
    Rules {
        own: config.robot.id,
        datum: fingerprint(&roster.datum),
        periods: roster.periods_fingerprint(),
        origin: 0,
        versions: Versions::OWN,
        history_ns,
        future_ns: AHEAD_NS,
        max_offset_s: section.max_offset_s,
        correct_offset: section.correct_offset,
    }
}
