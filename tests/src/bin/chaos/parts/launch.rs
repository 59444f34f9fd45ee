//! What must be done within a new process before it becomes the program that was asked for.

use std::error::Error;
use std::ffi::OsString;
use std::os::unix::process::CommandExt;
use std::process::Command;

use clap::Args;
use nix::sys::ptrace;
use rustix::process::{Resource, Rlimit, Signal, set_parent_process_death_signal, setrlimit};

#[derive(Args)]
pub(crate) struct LaunchArgs {
    /// Let the parent trace the program.
    #[arg(long)]
    traced: bool,
    /// Largest number of open files.
    #[arg(long)]
    files: Option<u64>,
    /// Largest address space \[MiB\].
    #[arg(long)]
    memory_mib: Option<u64>,
    /// Largest locked memory \[KiB\].
    #[arg(long)]
    locked_kib: Option<u64>,
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    program: Vec<OsString>,
}

pub(crate) fn launch(args: &LaunchArgs) -> Result<(), Box<dyn Error>> {
    set_parent_process_death_signal(Some(Signal::KILL))?;
    limit(Resource::Nofile, args.files)?;
    limit(Resource::As, args.memory_mib.map(|mib| mib << 20))?;
    limit(Resource::Memlock, args.locked_kib.map(|kib| kib << 10))?;
    if args.traced {
        ptrace::traceme()?;
    }
    let (program, rest) = args.program.split_first().ok_or("no program")?;
    Err(Command::new(program).args(rest).exec().into())
}

fn limit(resource: Resource, most: Option<u64>) -> rustix::io::Result<()> {
    most.map_or(Ok(()), |most| {
        let limit = Rlimit {
            current: Some(most),
            maximum: Some(most),
        };
        setrlimit(resource, limit)
    })
}
