//! Listening to a robot that comes and goes.

use std::path::{Path, PathBuf};
use std::time::Duration;

use coloc_shm_types::{Estimate, Lost, RobotName};

use super::args::ListenArgs;
use super::ear::{Ear, WhySilent};
use super::form::Form;
use super::hearing::{Hearing, News};
use super::seek::{choose, wait};
use super::silence::Silence;
use super::{ListenError, outlet};
use crate::demo::clock::now_ns;
use crate::demo::interrupt::Interrupt;
use crate::estimates::{Change, Estimates};
use crate::output::{complain, print_line, takes_no_more};
use crate::status::Status;

/// Between two looks, where nothing wakes it. A robot says a thousand estimates a second at most, and 16 wait.
const PAUSE: Duration = Duration::from_millis(5);
/// Where every estimate does: for a robot that is silent, and for an end that is asked for just before it sleeps.
const LONG_PAUSE: Duration = Duration::from_millis(100);
const SECOND_NS: i64 = 1_000_000_000;

pub(super) fn run(args: &ListenArgs) -> Result<Status, ListenError> {
    let interrupt = Interrupt::catch().map_err(ListenError::Signals)?;
    let (place, runs) = choose(args)?;
    let mut follower = Follower::new(args);
    if !runs {
        follower.hearing.is_missed();
    }
    if let Some(heading) = follower.form.beginning() {
        print_line(heading);
    }
    follower.follow_at(place.root, args, &interrupt)?;
    Ok(interrupt.signal().map_or(Status::Done, Status::Interrupted))
}

/// Why it is not heard any more in one place.
enum Parting {
    /// Nobody wants to.
    Enough,
    /// It does not run. Who stayed would keep what it has left.
    Gone,
    /// The shared memory was taken away.
    Lost(PathBuf),
}

/// One robot, wherever it is heard, and what was said of it.
struct Follower<'a> {
    robot: &'a RobotName,
    form: Form,
    hearing: Hearing,
    /// When the shared memory was last looked at.
    checked_ns: i64,
    silence: Silence,
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
            silence: Silence::default(),
            unreadable: 0,
        }
    }

    /// Until nobody wants to hear more, however often the robot and its shared memory go and come back.
    fn follow_at(
        &mut self,
        root: PathBuf,
        args: &ListenArgs,
        interrupt: &Interrupt,
    ) -> Result<(), ListenError> {
        let mut place = args.place.at(root)?;
        while wait(&place, self.robot, interrupt)? {
            place = args.place.at(place.root)?;
            let ear = match Ear::open(&place, self.robot) {
                // It went just then.
                Err(_) if !place.runs(self.robot)? => continue,
                ear => ear?,
            };
            let parting = self.follow(&ear, interrupt);
            self.tell_losses();
            match parting {
                Parting::Enough => break,
                Parting::Gone => {}
                Parting::Lost(path) => self.lose(&path),
            }
        }
        Ok(())
    }

    fn follow(&mut self, ear: &Ear, interrupt: &Interrupt) -> Parting {
        self.checked_ns = now_ns();
        while !interrupt.is_there() {
            // Before the look, so that nothing comes unnoticed after it.
            let bell = ear.estimates().bell();
            let took_all = self.listen(ear.estimates());
            if self.is_done() {
                break;
            }
            if let Some(parting) = self.look_after(ear, now_ns()) {
                return parting;
            }
            match bell {
                Some(bell) if took_all => outlet::pause_until(bell, LONG_PAUSE),
                _ => outlet::pause(PAUSE),
            }
        }
        Parting::Enough
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

    /// Takes what is there, for as long as somebody takes it from here; whether that is all.
    fn listen(&mut self, estimates: &Estimates) -> bool {
        while !self.is_done() {
            if !outlet::is_ready() {
                self.hearing.was_not_asked(now_ns());
                return false;
            }
            match estimates.receive() {
                Ok(Some(estimate)) => self.take(&estimate),
                Ok(None) => return true,
                Err(_) => {
                    self.unreadable += 1;
                    return false;
                }
            }
        }
        false
    }

    fn take(&mut self, estimate: &Estimate) {
        let now_ns = now_ns();
        if let Some(news) = self.hearing.heard(&estimate.header, now_ns) {
            self.silence = Silence::default();
            self.tell(news);
        }
        if let Some(text) = self.form.text(estimate, now_ns) {
            print_line(&text);
            let remark = self.form.remark(estimate);
            self.say(remark);
            let doubt = self.form.doubt(estimate);
            self.say(doubt.map(String::from));
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

    /// Where shared memory was deleted nobody seems to run: that is asked first.
    fn look_after(&mut self, ear: &Ear, now_ns: i64) -> Option<Parting> {
        if self.hearing.becomes_silent(now_ns) {
            let parting = self.check(ear);
            return parting.or_else(|| self.ask_why(ear, Silence::begins));
        }
        if now_ns - self.checked_ns < SECOND_NS {
            return None;
        }
        self.checked_ns = now_ns;
        self.tell_losses();
        let parting = self.check(ear);
        if parting.is_some() || !self.hearing.is_silent() {
            return parting;
        }
        self.ask_why(ear, Silence::goes_on)
    }

    /// Another process may act by now for a robot whose own has gone.
    fn check(&mut self, ear: &Ear) -> Option<Parting> {
        match ear.check()? {
            Change::Lost(Lost(path)) => Some(Parting::Lost(path)),
            Change::Gone => {
                let why = ear.why_silent(self.robot);
                if matches!(why, WhySilent::Gone) {
                    let news = self.silence.begins(why.to_string());
                    self.say(news);
                }
                Some(Parting::Gone)
            }
        }
    }

    /// Says it as far as it is news to `silence`; whether it is gone, which is sure at once.
    fn ask_why(
        &mut self,
        ear: &Ear,
        silence: fn(&mut Silence, String) -> Option<String>,
    ) -> Option<Parting> {
        let why = ear.why_silent(self.robot);
        let is_gone = matches!(why, WhySilent::Gone);
        let told = if is_gone { Silence::begins } else { silence };
        let news = told(&mut self.silence, why.to_string());
        self.say(news);
        is_gone.then_some(Parting::Gone)
    }

    fn say(&self, news: Option<String>) {
        if let Some(news) = news {
            complain(&format!("coloc: {} {news}", self.robot));
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
