//! Connections: who is let in, and what happens on a connection until its end.
use std::cell::RefCell;
use std::rc::Rc;

use coloc_shm_types::RobotName;
use tokio::sync::Notify;
use tokio::task::spawn_local;

use super::company::{IDLE_NS, Kept};
use super::office::{Office, now};
use super::{send, take};
use crate::budget::Budget;
use crate::engine::{Closing, Door, Engine, Line};
use crate::queue::Queue;

/// So many earlier connections of a member are kept.
const SPARE: usize = 4;

/// A member that is connected.
#[derive(Debug)]
pub(super) struct Member {
    pub(super) name: RobotName,
    /// What is sent goes here.
    pub(super) line: Line,
    /// Earlier connections that may still be up. Who called decides which of several stays; here all are listened to until then.
    pub(super) spare: Vec<Line>,
    pub(super) queue: Queue,
    /// Something was put into the queue.
    pub(super) put: Rc<Notify>,
    /// What may be said to it.
    pub(super) told: Budget,
    /// What it may say to us.
    pub(super) heard: Budget,
    /// So long it counts as somebody with whom something is exchanged (ns of `CLOCK_BOOTTIME`).
    pub(super) company_until_ns: i64,
}

/// Lets in who calls.
pub(super) async fn answer(office: Rc<RefCell<Office>>, engine: Engine, door: Door) {
    while let Some(incoming) = engine.knock().await {
        let Some(guest) = door.admits(incoming) else {
            continue;
        };
        let (office, door) = (Rc::clone(&office), door.clone());
        spawn_local(async move {
            match door.hear(guest).await {
                Ok(line) => keep(office, line).await,
                Err((from, error)) => {
                    let text = format!("a call from {from} was refused: {error}");
                    office.borrow_mut().teller.remark(text);
                }
            }
        });
    }
}

/// Keeps a connection until its end.
pub(super) async fn keep(office: Rc<RefCell<Office>>, line: Line) {
    let Some(id) = begin(&office, &line) else {
        return;
    };
    let datagrams = spawn_local(take::datagrams(Rc::clone(&office), id, line.clone()));
    let streams = spawn_local(take::streams(Rc::clone(&office), id, line.clone()));
    let sender = spawn_local(send::empty_queue(Rc::clone(&office), id, line.clone()));
    let why = line.ended().await;
    for task in [datagrams, streams, sender] {
        task.abort();
    }
    office.borrow_mut().lose(id, &line, &why);
}

/// The member's number, if it is one still.
fn begin(office: &Rc<RefCell<Office>>, line: &Line) -> Option<u16> {
    let mut office = office.borrow_mut();
    let roster = office.roster();
    let owner = roster.owner(line.key())?;
    let now_ns = now().boot_ns;
    let per_s = f64::from(office.section.max_bytes_per_s);
    let member = Member {
        name: owner.name.clone(),
        line: line.clone(),
        spare: Vec::new(),
        queue: Queue::default(),
        put: Rc::new(Notify::new()),
        told: Budget::new(per_s, now_ns),
        heard: Budget::new(take::MORE_THAN_SAID * per_s, now_ns),
        company_until_ns: now_ns.saturating_add(send::BEGINNING_NS),
    };
    office.welcome(owner.id, member);
    for hello in office.hello(owner.id) {
        send::at_once(line.clone(), hello);
    }
    Some(owner.id)
}

impl Office {
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
        self.past.add(&line.vitals());
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

    /// Ends connections of a large team over which nothing is said any more.
    pub(super) fn give_up_idle(&mut self) {
        let now_ns = now().boot_ns;
        let kept = Kept::of(self.book.roster(), self.own);
        let idle = self.members.iter().filter(|(id, member)| {
            !kept.has(**id) && member.company_until_ns.saturating_add(IDLE_NS) < now_ns
        });
        idle.for_each(|(_, member)| member.line.close(Closing::Idle));
        self.wanted
            .tidy(now_ns, |id| self.members.contains_key(&id));
    }
}
