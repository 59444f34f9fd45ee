//! Runs a program and stops it at every system call, at its entry and at its exit; harms it at the one that was asked for.
//!
//! All its threads are counted together. What it says is read by the fleet: `pid P`, `term N` when SIGTERM arrives after N
//! stops, then `harmed N at call C` or `ended after N`.

use std::collections::{HashMap, HashSet};
use std::error::Error;
use std::ffi::OsString;
use std::process::Command;
use std::thread::sleep;
use std::time::Duration;

use clap::{Args, ValueEnum};
use coloc_tests::output::print_line;
use nix::sys::ptrace::{self, Options};
use nix::sys::signal::{Signal, kill};
use nix::sys::wait::{WaitPidFlag, WaitStatus, waitpid};
use nix::unistd::Pid;
use rustix::process::set_parent_process_death_signal;

#[derive(Args)]
pub(crate) struct TraceArgs {
    /// At which stop to do harm.
    #[arg(long)]
    at: Option<u64>,
    #[arg(long, value_enum, default_value_t = CountFrom::Start)]
    from: CountFrom,
    #[command(flatten)]
    harm: HarmArgs,
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    program: Vec<OsString>,
}

/// Which harm, if it is not to be killed.
#[derive(Args)]
#[group(multiple = false)]
struct HarmArgs {
    /// To stand still for so long \[ms\].
    #[arg(long)]
    hold_ms: Option<u64>,
    /// SIGTERM.
    #[arg(long)]
    term: bool,
}

/// Where counting begins.
#[derive(Copy, Clone, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum CountFrom {
    /// At the first system call.
    Start,
    /// When SIGTERM arrives.
    Term,
}

pub(crate) fn trace(args: &TraceArgs) -> Result<(), Box<dyn Error>> {
    set_parent_process_death_signal(Some(rustix::process::Signal::KILL))?;
    let mut launch = Command::new(std::env::current_exe()?);
    launch.args(["part", "launch", "--traced"]);
    let child = launch.args(&args.program).spawn()?;
    let pid = Pid::from_raw(child.id().try_into()?);
    waitpid(pid, None)?; // It has become the program.
    ptrace::setoptions(
        pid,
        Options::PTRACE_O_TRACESYSGOOD | Options::PTRACE_O_TRACECLONE | Options::PTRACE_O_EXITKILL,
    )?;
    print_line(&format!("pid {pid}"));
    ptrace::syscall(pid, None)?;
    Tracer::new(args, pid).run()
}

struct Tracer<'a> {
    args: &'a TraceArgs,
    pid: Pid,
    threads: HashSet<Pid>,
    /// The last system call of each thread.
    calls: HashMap<Pid, u64>,
    stops: u64,
    counts: bool,
}

impl<'a> Tracer<'a> {
    fn new(args: &'a TraceArgs, pid: Pid) -> Self {
        Self {
            args,
            pid,
            threads: HashSet::from([pid]),
            calls: HashMap::new(),
            stops: 0,
            counts: args.from == CountFrom::Start,
        }
    }

    fn run(&mut self) -> Result<(), Box<dyn Error>> {
        loop {
            match waitpid(None, Some(WaitPidFlag::__WALL))? {
                WaitStatus::PtraceSyscall(thread) => {
                    self.stopped(thread);
                    go_on(thread, None);
                }
                WaitStatus::Stopped(thread, signal) => {
                    let signal = self.signalled(thread, signal);
                    go_on(thread, signal);
                }
                WaitStatus::PtraceEvent(thread, ..) => go_on(thread, None),
                WaitStatus::Exited(thread, status) if thread == self.pid => {
                    print_line(&format!("ended after {} with status {status}", self.stops));
                    return Ok(());
                }
                WaitStatus::Signaled(thread, signal, _) if thread == self.pid => {
                    print_line(&format!("ended after {} by {signal}", self.stops));
                    return Ok(());
                }
                _ => {}
            }
        }
    }

    /// At the entry or at the exit of a system call.
    fn stopped(&mut self, thread: Pid) {
        let entered = entered(thread);
        if let Some(call) = entered {
            self.calls.insert(thread, call);
        }
        if !self.counts {
            return;
        }
        self.stops += 1;
        if self.args.at == Some(self.stops) {
            let side = if entered.is_some() { "entry" } else { "exit" };
            let call = self.calls.get(&thread).copied().unwrap_or_default();
            self.harm();
            print_line(&format!("harmed {} at {side} of call {call}", self.stops));
        }
    }

    fn harm(&self) {
        let HarmArgs { hold_ms, term } = self.args.harm;
        let signal = if term {
            Signal::SIGTERM
        } else {
            Signal::SIGKILL
        };
        match hold_ms {
            // Whoever of the other threads comes to a system call stands still, too: nobody lets it go on.
            Some(ms) => sleep(Duration::from_millis(ms)),
            None => {
                let _ = kill(self.pid, signal);
            }
        }
    }

    /// What is to be passed on.
    fn signalled(&mut self, thread: Pid, signal: Signal) -> Option<Signal> {
        if self.threads.insert(thread) && signal == Signal::SIGSTOP {
            return None; // A new thread begins with it.
        }
        if signal == Signal::SIGTERM {
            print_line(&format!("term {}", self.stops));
            self.counts = true;
        }
        Some(signal)
    }
}

/// The call, at its entry.
fn entered(thread: Pid) -> Option<u64> {
    let info = ptrace::syscall_info(thread).ok()?;
    (info.op == nix::libc::PTRACE_SYSCALL_INFO_ENTRY).then(|| call_of(&info))
}

#[allow(unsafe_code, reason = "the kernel's answer is a union")]
fn call_of(info: &nix::libc::ptrace_syscall_info) -> u64 {
    // SAFETY: at an entry, which the caller has checked, the kernel has filled in this member.
    unsafe { info.u.entry.nr }
}

/// It may have been killed meanwhile.
fn go_on(thread: Pid, signal: Option<Signal>) {
    let _ = ptrace::syscall(thread, signal);
}
