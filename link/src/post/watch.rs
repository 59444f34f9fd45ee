//! From shared memory to the queues.
use std::borrow::Cow;
use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use coloc_sensors::EndError;
use coloc_shm_types::{Channel, Clock, Header, RobotName};
use tokio::task::spawn_local;

use super::office::{Office, now};
use super::send::{self, COMPANY_NS};
use crate::admission::Peer;
use crate::kinds::Kind;
use crate::queue::Waiting;
use crate::reach::Reach;
use crate::roster::Role;
use crate::space::Ear;

/// Listens to all channels on which the own robot says something for other members, those of new members among them. Each takes a
/// millisecond to open, and the network does not wait for all of them: members are called meanwhile.
pub(super) async fn listen(office: &Rc<RefCell<Office>>) -> Result<(), EndError> {
    let wanted = office.borrow().unheard();
    for (robot, kind, receiver) in wanted {
        tokio::task::yield_now().await;
        let channel = kind.told.channel;
        let space = office.borrow().space.clone();
        office.borrow_mut().heard.push((robot.clone(), channel));
        if Reach::of(&kind) == Reach::Stations {
            let ear = Ear::open(&space, &robot, channel)?;
            spawn_local(look(Rc::clone(office), ear, kind));
        } else {
            let ear = Ear::open_to_wait(&space, &robot, channel)?;
            spawn_local(hear(Rc::clone(office), ear, kind, receiver));
        }
    }
    Ok(())
}

async fn hear(office: Rc<RefCell<Office>>, mut ear: Ear, kind: Kind, receiver: Option<u16>) {
    loop {
        {
            let mut office = office.borrow_mut();
            ear.hear(&mut |header, bytes| office.carry(&kind, receiver, header, bytes));
        }
        send::send_all(&office);
        ear.wait().await;
    }
}

/// Takes the newest now and then: stations need no more, and who speaks need not wake anybody.
async fn look(office: Rc<RefCell<Office>>, mut ear: Ear, kind: Kind) {
    let period = Duration::from_secs_f64(1.0 / office.borrow().section.watch_hz);
    loop {
        let mut newest = None;
        ear.hear(&mut |header, bytes| newest = Some((*header, bytes.to_vec())));
        if let Some((header, bytes)) = newest {
            office.borrow_mut().carry(&kind, None, &header, &bytes);
            send::send_all(&office);
        }
        tokio::time::sleep(period).await;
    }
}

/// Who listens to what is for nobody by name.
fn listeners(reach: Reach) -> Role {
    if reach == Reach::Stations {
        Role::Station
    } else {
        Role::Robot
    }
}

impl Office {
    /// Channels that have to be listened to and are not yet, and for whom it is what is said there, if for one.
    fn unheard(&self) -> Vec<(RobotName, Kind, Option<u16>)> {
        if !self.speaks() {
            return Vec::new();
        }
        let roster = self.roster();
        let own = roster.member(self.own);
        let others = || roster.member.iter().filter(|it| it.id != self.own);
        let mut wanted = Vec::new();
        for kind in Kind::all() {
            if !own.is_some_and(|own| own.may_say(kind)) {
                continue;
            }
            match Reach::of(kind) {
                Reach::Here => {}
                Reach::Addressee => {
                    let is_listed = |id| self.listed.is_empty() || self.listed.contains(&id);
                    let robots = others().filter(|it| it.role == Role::Robot && is_listed(it.id));
                    wanted.extend(robots.map(|it| (it.name.clone(), *kind, Some(it.id))));
                }
                Reach::Team | Reach::Stations => {
                    let role = listeners(Reach::of(kind));
                    if others().any(|it| it.role == role) {
                        wanted.push((self.name.clone(), *kind, None));
                    }
                }
            }
        }
        let is_heard = |robot: &RobotName, channel: Channel| {
            self.heard
                .iter()
                .any(|it| it.0 == *robot && it.1 == channel)
        };
        wanted.retain(|(robot, kind, _)| !is_heard(robot, kind.told.channel));
        wanted
    }

    /// Puts what the own robot has said into the queues of those for whom it is.
    fn carry(&mut self, kind: &Kind, receiver: Option<u16>, header: &Header, bytes: &[u8]) {
        // What others say here came over the network, or is their own link's to carry.
        if header.source != self.own {
            return;
        }
        let roster = self.roster();
        let to: Vec<u16> = if let Some(id) = receiver {
            vec![id]
        } else {
            let role = listeners(Reach::of(kind));
            let members = roster.member.iter();
            let listeners = members.filter(|it| it.role == role && it.id != self.own);
            listeners.map(|it| it.id).collect()
        };
        let is_local = |id: u16| {
            let name = roster.member(id).map(|it| it.name.as_str());
            name.is_some_and(|name| self.local.iter().any(|local| local == name))
        };
        let to: Vec<u16> = to.into_iter().filter(|id| !is_local(*id)).collect();
        for id in to {
            self.put(kind, id, header, bytes);
        }
    }

    fn put(&mut self, kind: &Kind, id: u16, header: &Header, bytes: &[u8]) {
        let present = now();
        if !self.members.contains_key(&id) {
            self.counts.not_connected += 1;
            self.wanted.want(id, present.boot_ns);
            return;
        }
        let hello = self.admission.peer(id).and_then(Peer::hello);
        if !hello.is_some_and(|hello| hello.kinds.contains(&kind.code)) {
            self.counts.not_spoken_there += 1;
            return;
        }
        if header.clock() != Ok(Clock::Realtime) {
            self.counts.foreign_clock += 1;
            self.teller.remark(
                "the robot's stamps are not of the shared clock: set clock.source = \"realtime\" in its robot.toml",
            );
            return;
        }
        let age_ns = present.wall_ns.saturating_sub(header.stamp_ns);
        let left_ns = self.oldest_ns(kind).saturating_sub(age_ns);
        if left_ns < 0 {
            self.counts.too_old_to_send += 1;
            return;
        }
        let bytes = self.for_its_clock(kind, id, header.stamp_ns, bytes);
        let Some(message) = self.seal(kind.code, id, &bytes) else {
            self.counts.not_spoken_there += 1;
            return;
        };
        let waiting = Waiting {
            kind: kind.code,
            matters: kind.told.matters,
            until_ns: present.boot_ns.saturating_add(left_ns),
            bytes: message,
        };
        if let Some(member) = self.members.get_mut(&id) {
            member.company_until_ns = present.boot_ns.saturating_add(COMPANY_NS);
            self.counts.pushed_out += member.queue.push(waiting);
        }
    }

    /// What answers has the stamp of what it answers, which the link has corrected when that came: the receiver knows it by its own
    /// clock, to the nanosecond. What is not known of the correction is not known of where the own robot was then.
    fn for_its_clock<'a>(
        &mut self,
        kind: &Kind,
        id: u16,
        stamp_ns: i64,
        bytes: &'a [u8],
    ) -> Cow<'a, [u8]> {
        let peer = self
            .admission
            .peer(id)
            .filter(|_| self.section.correct_offset && kind.echoes);
        let correction = peer.map(Peer::correction).unwrap_or_default();
        let shown_by_ns = self.clock.shows(stamp_ns) - stamp_ns;
        let by_ns = shown_by_ns.saturating_sub(correction.by_ns);
        if by_ns == 0 && correction.variance_s2 == 0.0 {
            return Cow::Borrowed(bytes);
        }
        let added = self.motion.blur(correction.variance_s2);
        let mut theirs = bytes.to_vec();
        match kind.correct(&mut theirs, by_ns, &added) {
            Some(()) => Cow::Owned(theirs),
            None => Cow::Borrowed(bytes),
        }
    }
}
