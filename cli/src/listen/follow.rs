//! Listening to a robot that comes and goes.

use std::time::Duration;

use coloc_shm_types::{Estimate, RobotName, Space, Subscriber};

use super::args::ListenArgs;
use super::form::Form;
use super::hearing::{Hearing, News};
use super::{ListenError, outlet};
use crate::demo::clock::now_ns;
use crate::demo::interrupt::Interrupt;
use crate::output::{complain, print_line, takes_no_more};
use crate::place::{Found, Looked, Place, look};
use crate::status::Status;

/// Between two looks. A robot says a thousand estimates a second at most, and 16 wait.
const PAUSE: Duration = Duration::from_millis(5);
const SECOND_NS: i64 = 1_000_000_000;

pub(super) fn run(args: &ListenArgs) -> Result<Status, ListenError> {
    let interrupt = Interrupt::catch().map_err(ListenError::Signals)?;
    let (place, runs) = choose(look(&args.place), &args.robot)?;
    let mut follower = Follower::start(args, place, runs)?;
    let status = follower.follow(&interrupt);
    follower.tell_losses();
    status
}

/// Where it runs, or else where it is waited for, and which of both.
fn choose(looked: Looked, robot: &RobotName) -> Result<(Place, bool), ListenError> {
    let runs = |found: &&Found| found.robots.iter().any(|one| one.robot == *robot);
    if let Some(found) = looked.here.as_ref().ok().filter(runs) {
        return Ok((found.place.clone(), true));
    }
    if let Some(found) = looked.elsewhere.iter().find(runs) {
        complain(&format!("coloc: {robot} runs in {}", found.place));
        return Ok((found.place.clone(), true));
    }
    let here = looked.here?;
    complain(&format!(
        "coloc: {robot} does not run here, waiting for it in {}; {}",
        here.place,
        who_else(&here, &looked.elsewhere)
    ));
    Ok((here.place, false))
}

/// Who runs instead: it may have been misspelt.
fn who_else(here: &Found, elsewhere: &[Found]) -> String {
    let inhabited = |found: &&Found| !found.robots.is_empty();
    let all: Vec<String> = std::iter::once(here)
        .filter(inhabited)
        .map(Found::names)
        .chain(
            elsewhere
                .iter()
                .map(|found| format!("{} in {}", found.names(), found.place)),
        )
        .collect();
    if all.is_empty() {
        return "nobody else runs".into();
    }
    format!("who runs: {}", all.join("; "))
}

struct Follower<'a> {
    robot: &'a RobotName,
    place: Place,
    form: Form,
    hearing: Hearing,
    /// When the shared memory was last looked at.
    checked_ns: i64,
    /// Messages that were there and could not be read.
    unreadable: u64,
    estimates: Subscriber<Estimate>,
    space: Space,
}

impl<'a> Follower<'a> {
    fn start(args: &'a ListenArgs, place: Place, runs: bool) -> Result<Self, ListenError> {
        let space = Space::open(&place.root, &place.prefix, "coloc-listen")?;
        let estimates = space.subscriber(&args.robot)?;
        Ok(Self {
            robot: &args.robot,
            place,
            form: Form::new(args),
            hearing: Hearing::begin(now_ns(), !runs),
            checked_ns: now_ns(),
            unreadable: 0,
            estimates,
            space,
        })
    }

    fn follow(&mut self, interrupt: &Interrupt) -> Result<Status, ListenError> {
        if let Some(heading) = self.form.beginning() {
            print_line(heading);
        }
        loop {
            if let Some(signal) = interrupt.signal() {
                return Ok(Status::Interrupted(signal));
            }
            self.listen();
            if self.form.is_enough() || takes_no_more() {
                return Ok(Status::Done);
            }
            self.look_after(now_ns())?;
            outlet::pause(PAUSE);
        }
    }

    /// Takes what is there, for as long as somebody takes it from here.
    fn listen(&mut self) {
        while !self.form.is_enough() && !takes_no_more() {
            if !outlet::is_ready() {
                return self.hearing.was_not_asked(now_ns());
            }
            match self.estimates.receive() {
                Ok(Some(estimate)) => self.take(&estimate),
                Ok(None) => return,
                Err(_) => return self.unreadable += 1,
            }
        }
    }

    fn take(&mut self, estimate: &Estimate) {
        let now_ns = now_ns();
        if let Some(news) = self.hearing.heard(&estimate.header, now_ns) {
            self.tell(news);
        }
        if let Some(text) = self.form.text(estimate, now_ns) {
            print_line(&text);
        }
    }

    fn tell(&self, news: News) {
        let said = match news {
            News::Speaks => "speaks".into(),
            News::Restarted => "was started again".into(),
            News::Again {
                after_ns,
                restarted,
            } => {
                let how = if restarted { ", started anew" } else { "" };
                let (seconds, tenths) = (after_ns / SECOND_NS, after_ns / (SECOND_NS / 10) % 10);
                format!("speaks again{how}, after {seconds}.{tenths} s")
            }
        };
        complain(&format!("coloc: {} {said}", self.robot));
    }

    fn look_after(&mut self, now_ns: i64) -> Result<(), ListenError> {
        if self.hearing.becomes_silent(now_ns) {
            complain(&format!("coloc: {} {}", self.robot, self.why_silent()));
        }
        if now_ns - self.checked_ns >= SECOND_NS {
            self.checked_ns = now_ns;
            self.tell_losses();
            self.space.check()?;
        }
        Ok(())
    }

    fn why_silent(&self) -> String {
        let running = Space::running(&self.place.root).unwrap_or_default();
        let own = running.iter().find(|one| one.robot == *self.robot);
        match own.map(|own| own.who) {
            None => "does not run any more, waiting for it".into(),
            Some(None) => "runs and says nothing".into(),
            Some(Some((_, process))) => {
                format!("is silent, though process {process} acts for it")
            }
        }
    }

    fn tell_losses(&mut self) {
        let lost = self.hearing.take_lost();
        if lost > 0 {
            complain(&format!(
                "coloc: {lost} estimates of {} were lost: they came faster than they were read",
                self.robot
            ));
        }
        let unreadable = std::mem::take(&mut self.unreadable);
        if unreadable > 0 {
            complain(&format!(
                "coloc: estimates of {} could not be read ({unreadable} times)",
                self.robot
            ));
        }
    }
}
