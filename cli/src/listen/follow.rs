//! Listening to a robot that comes and goes.

use std::path::Path;
use std::time::Duration;

use coloc_shm_types::{Estimate, Lost, RobotName, Space, Subscriber};

use super::args::ListenArgs;
use super::form::Form;
use super::hearing::{Hearing, News};
use super::seek::{choose, wait};
use super::{ListenError, outlet};
use crate::demo::clock::now_ns;
use crate::demo::interrupt::Interrupt;
use crate::output::{complain, print_line, takes_no_more};
use crate::place::Place;
use crate::status::Status;

/// Between two looks. A robot says a thousand estimates a second at most, and 16 wait.
const PAUSE: Duration = Duration::from_millis(5);
const SECOND_NS: i64 = 1_000_000_000;

pub(super) fn run(args: &ListenArgs) -> Result<Status, ListenError> {
    let interrupt = Interrupt::catch().map_err(ListenError::Signals)?;
    let mut follower = Follower::new(args);
    if let Some(heading) = follower.form.beginning() {
        print_line(heading);
    }
    let (mut place, runs) = choose(args)?;
    if !runs {
        follower.hearing.is_missed();
    }
    while wait(&place, &args.robot, &interrupt)? {
        place = args.place.at(place.root)?;
        let ear = match Ear::open(&place, &args.robot) {
            // It went just then.
            Err(_) if !place.runs(&args.robot)? => continue,
            ear => ear?,
        };
        let followed = follower.follow(&ear, &interrupt);
        follower.tell_losses();
        match followed {
            Ok(()) => break,
            Err(Lost(path)) => follower.lose(&path),
        }
    }
    Ok(interrupt.signal().map_or(Status::Done, Status::Interrupted))
}

/// What it is heard with.
struct Ear {
    estimates: Subscriber<Estimate>,
    space: Space,
    place: Place,
}

impl Ear {
    fn open(place: &Place, robot: &RobotName) -> Result<Self, ListenError> {
        let space = Space::join(&place.root, &place.prefix, "coloc-listen")?;
        let estimates = space.subscriber(robot)?;
        Ok(Self {
            estimates,
            space,
            place: place.clone(),
        })
    }

    fn why_silent(&self, robot: &RobotName) -> String {
        let running = Space::running(&self.place.root).unwrap_or_default();
        let own = running.iter().find(|one| one.robot == *robot);
        match own.map(|own| own.who) {
            None => "does not run any more, waiting for it".into(),
            Some(None) => "runs and says nothing".into(),
            Some(Some((_, process))) => {
                format!("is silent, though process {process} acts for it")
            }
        }
    }
}

struct Follower<'a> {
    robot: &'a RobotName,
    form: Form,
    hearing: Hearing,
    /// When the shared memory was last looked at.
    checked_ns: i64,
    /// What was last said of its silence.
    why: Option<String>,
    /// Messages that were there and could not be read.
    unreadable: u64,
}

impl<'a> Follower<'a> {
    fn new(args: &'a ListenArgs) -> Self {
        Self {
            robot: &args.robot,
            form: Form::new(args),
            hearing: Hearing::begin(now_ns()),
            checked_ns: now_ns(),
            why: None,
            unreadable: 0,
        }
    }

    /// Until nobody wants to hear more, or the shared memory is gone.
    fn follow(&mut self, ear: &Ear, interrupt: &Interrupt) -> Result<(), Lost> {
        while !interrupt.is_there() {
            self.listen(&ear.estimates);
            if self.is_done() {
                break;
            }
            self.look_after(ear, now_ns())?;
            outlet::pause(PAUSE);
        }
        Ok(())
    }

    fn is_done(&self) -> bool {
        self.form.is_enough() || takes_no_more()
    }

    fn lose(&mut self, path: &Path) {
        self.hearing.is_missed();
        let path = path.display();
        complain(&format!(
            "coloc: {path} was deleted or exchanged: looking for {} anew",
            self.robot
        ));
    }

    /// Takes what is there, for as long as somebody takes it from here.
    fn listen(&mut self, estimates: &Subscriber<Estimate>) {
        while !self.is_done() {
            if !outlet::is_ready() {
                return self.hearing.was_not_asked(now_ns());
            }
            match estimates.receive() {
                Ok(Some(estimate)) => self.take(&estimate),
                Ok(None) => return,
                Err(_) => return self.unreadable += 1,
            }
        }
    }

    fn take(&mut self, estimate: &Estimate) {
        let now_ns = now_ns();
        if let Some(news) = self.hearing.heard(&estimate.header, now_ns) {
            self.why = None;
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

    fn look_after(&mut self, ear: &Ear, now_ns: i64) -> Result<(), Lost> {
        if self.hearing.becomes_silent(now_ns) {
            self.say_why(ear);
        }
        if now_ns - self.checked_ns >= SECOND_NS {
            self.checked_ns = now_ns;
            self.tell_losses();
            ear.space.check()?;
            if self.hearing.is_silent() {
                self.say_why(ear);
            }
        }
        Ok(())
    }

    /// Why it is not heard, unless that was said.
    fn say_why(&mut self, ear: &Ear) {
        let why = Some(ear.why_silent(self.robot));
        if self.why != why {
            self.why = why;
            let why = self.why.as_deref().unwrap_or_default();
            complain(&format!("coloc: {} {why}", self.robot));
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
