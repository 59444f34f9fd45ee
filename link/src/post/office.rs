//! What all tasks of a link share.
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::{Arc, PoisonError, RwLock};
use std::time::Instant;

use coloc_daemon::config::Config;
use coloc_sensors::status::{Line as InputLine, Reporter};
use coloc_sensors::teller::Teller;
use coloc_sensors::{EndError, Moment as Present};
use coloc_shm_types::private::OwnFile;
use coloc_shm_types::{Age, Channel, Claim, RobotName, Space};

use super::company::{IDLE_NS, Kept, Wanted};
use super::counts::Counts;
use super::lines::Member;
use super::motion::Motion;
use crate::admission::{Admission, Now, Rules, own_hello};
use crate::engine::{Closing, Door, Line, Vitals};
use crate::keys::{Identity, PublicKey};
use crate::kinds::Kind;
use crate::roster::{Book, FLEET, Moment, Offer, Role, Roster, fingerprint};
use crate::section::Link;
use crate::space::Mouth;
use crate::tls::Members;
use crate::wire::{Envelope, Versions, seal, word};
use crate::wrong_clock::WrongClock;

const NAME: &str = "coloc-link";
const DRIVER: &str = "link";

/// Who is let in: the members of the newest roster, but for the robot itself.
#[derive(Debug)]
pub struct Team {
    roster: RwLock<Arc<Roster>>,
    own: u16,
}

impl Team {
    fn newest(&self) -> Arc<Roster> {
        let roster = self.roster.read().unwrap_or_else(PoisonError::into_inner);
        Arc::clone(&roster)
    }

    fn set(&self, newer: Arc<Roster>) {
        *self.roster.write().unwrap_or_else(PoisonError::into_inner) = newer;
    }
}

impl Members for Team {
    fn admits(&self, key: &PublicKey) -> bool {
        let roster = self.newest();
        let owner = roster.owner(key).filter(|owner| owner.id != self.own);
        owner.is_some_and(|owner| {
            roster
                .standing(owner.id, Moment::of_ns(now().wall_ns))
                .is_ok()
        })
    }
}

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
    rules: Rules,
    session: u64,
    sequences: BTreeMap<u32, u64>,
    mouths: BTreeMap<(u16, u32), Mouth>,
    reporter: Reporter,
    /// Two links of one robot would carry everything twice.
    _claim: Claim,
    /// The robot's own directory.
    pub(super) directory: PathBuf,
    fleet: PathBuf,
    fleet_text: String,
    door: Door,
    opened: u64,
    /// Of connections that are over.
    past: Vitals,
    /// The last that was known of each member, by name.
    last: BTreeMap<String, String>,
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
        let team = Arc::new(Team {
            roster: RwLock::new(roster),
            own,
        });
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

    /// The last words: a line for each member, for whoever reads the log.
    pub(super) fn finish(&mut self) {
        self.teller.finish();
        self.teller.remark(self.counts.words());
        self.teller.finish();
        for (name, words) in &self.last {
            self.teller.remark(format!("{name}: {words}"));
            self.teller.finish();
        }
    }

    /// What is known of each member that is connected.
    fn note_members(&mut self) {
        for (id, member) in &self.members {
            let vitals = member.line.vitals();
            let offset = self
                .admission
                .peer(*id)
                .and_then(crate::admission::Peer::offset);
            let offset = offset.map_or_else(
                || "unknown".into(),
                |it| format!("{:+.3} ± {:.3} ms", 1e3 * it.offset_s, 1e3 * it.within_s),
            );
            let words = format!(
                "round trip {:.1} ms, lost {:.1} % of {}, clock {offset}",
                1e3 * vitals.round_trip_s,
                vitals.lost_percent(),
                vitals.sent
            );
            self.last.insert(member.name.to_string(), words);
        }
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

    /// Takes a roster that somebody offers; whether it is in force now.
    pub(super) fn offer(&mut self, text: &str, by: &str) -> bool {
        match self.book.offer(text) {
            Ok(Offer::Newer) => {
                self.remember();
                self.apply();
                let version = self.book.roster().version;
                self.teller
                    .remark(format!("roster {version} is in force, from {by}"));
                true
            }
            Ok(Offer::Another) => {
                self.teller.remark(format!(
                    "{by} has another roster with the version of this one: sign a newer one"
                ));
                false
            }
            Ok(Offer::Same | Offer::Old) => false,
            Err(error) => {
                self.teller.remark(format!("{by}: {error}"));
                false
            }
        }
    }

    /// Writes the roster down, so that the next start begins with it.
    fn remember(&mut self) {
        self.fleet_text = self.book.text().into();
        let text = self.fleet_text.clone();
        let written = OwnFile::named(&self.fleet).and_then(|file| file.replace(text.as_bytes()));
        if let Err(error) = written {
            self.teller
                .remark(format!("the roster cannot be written: {error}"));
        }
    }

    /// The roster decides, also over connections that are up.
    fn apply(&mut self) {
        let roster = Arc::new(self.book.roster().clone());
        self.team.set(Arc::clone(&roster));
        self.rules.datum = roster.datum_fingerprint();
        self.rules.periods = roster.periods_fingerprint();
        self.admission.set_rules(self.rules.clone());
        self.admission.forget_strangers(&roster);
        self.dismiss();
        let gone = |id: &u16| roster.member(*id).is_none();
        self.mouths.retain(|(speaker, _), _| !gone(speaker));
    }

    /// Ends connections of those who are no members any more.
    fn dismiss(&mut self) {
        let team = Arc::clone(&self.team);
        let teller = &mut self.teller;
        self.members.retain(|_, member| {
            let stays = team.admits(member.line.key());
            if !stays {
                let lines = member.spare.iter().chain([&member.line]);
                lines.for_each(|line| line.close(Closing::Revoked));
                teller.remark(format!("{} is no member any more", member.name));
            }
            stays
        });
    }

    /// Ends connections of a large team over which nothing is said any more.
    fn give_up_idle(&mut self) {
        let now_ns = now().boot_ns;
        let kept = Kept::of(self.book.roster(), self.own);
        let idle = self.members.iter().filter(|(id, member)| {
            !kept.has(**id) && member.company_until_ns.saturating_add(IDLE_NS) < now_ns
        });
        idle.for_each(|(_, member)| member.line.close(Closing::Idle));
        self.wanted
            .tidy(now_ns, |id| self.members.contains_key(&id));
    }

    /// A file that somebody has exchanged is a roster that is offered.
    fn look_at_the_file(&mut self) {
        let read = std::fs::read_to_string(&self.fleet);
        let Ok(text) = read else { return };
        if text != self.fleet_text && text.len() <= Roster::LONGEST {
            self.fleet_text.clone_from(&text);
            if self.offer(&text, "the file") {
                self.hand_on_the_roster();
            }
        }
    }

    /// What is done once a second.
    pub(super) fn second(&mut self) -> Result<(), EndError> {
        self.look_at_the_file();
        self.dismiss();
        self.give_up_idle();
        self.note_members();
        let running = Space::running(&self.root).unwrap_or_default();
        self.local = running.into_iter().map(|it| it.robot.to_string()).collect();
        self.space.tidy();
        let line = InputLine {
            is_open: !self.members.is_empty(),
            opened: self.opened,
            bytes: self.vitals().heard_bytes,
        };
        let mut report = self.counts.report();
        report.figures = self.figures();
        if self.reporter.report(line, &report).is_some() {
            self.space.check()?;
        }
        self.teller.tell(Instant::now());
        Ok(())
    }

    /// Of all connections there ever were.
    fn vitals(&self) -> Vitals {
        let mut all = self.past;
        for member in self.members.values() {
            add(&mut all, &member.line.vitals());
        }
        all
    }

    #[expect(clippy::cast_precision_loss, reason = "counts, for people")]
    fn figures(&self) -> [f64; 8] {
        let (all, knocks) = (self.vitals(), self.door.knocks());
        let offsets = self.admission.offsets();
        let worst_s = offsets
            .iter()
            .map(|(_, it)| it.offset_s.abs())
            .fold(f64::NAN, f64::max);
        let members = self.book.roster().member.len().saturating_sub(1);
        [
            members as f64,
            self.members.len() as f64,
            all.sent_bytes as f64,
            all.heard_bytes as f64,
            (knocks.strangers + knocks.silent) as f64,
            knocks.unheard as f64,
            all.round_trip_s,
            worst_s,
        ]
    }

    /// A member is connected, by another connection perhaps.
    pub(super) fn welcome(&mut self, id: u16, member: Member) {
        self.opened += 1;
        let Some(known) = self.members.get_mut(&id) else {
            let text = format!("{} is connected ({})", member.name, member.line.address());
            self.teller.remark(text);
            self.members.insert(id, member);
            return;
        };
        let before = std::mem::replace(&mut known.line, member.line);
        known.spare.push(before);
        if known.spare.len() > SPARE {
            known.spare.remove(0).close(Closing::Replaced);
        }
        known.put.notify_waiters();
    }

    /// A connection is over.
    pub(super) fn lose(&mut self, id: u16, line: &Line, why: &str) {
        add(&mut self.past, &line.vitals());
        let Some(member) = self.members.get_mut(&id) else {
            return;
        };
        member.spare.retain(|spare| !spare.is(line));
        if !member.line.is(line) {
            return;
        }
        if let Some(spare) = member.spare.pop() {
            member.line = spare;
            member.put.notify_waiters();
            return;
        }
        let text = format!("{} is gone: {why}", member.name);
        self.teller.remark(text);
        self.members.remove(&id);
    }
}

/// So many earlier connections of a member are kept.
const SPARE: usize = 4;

fn add(all: &mut Vitals, more: &Vitals) {
    all.round_trip_s = all.round_trip_s.max(more.round_trip_s);
    all.sent += more.sent;
    all.lost += more.lost;
    all.sent_bytes += more.sent_bytes;
    all.heard_bytes += more.heard_bytes;
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
