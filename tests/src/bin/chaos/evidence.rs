//! What a process is doing that does not do what it should.

use std::fmt::Write;
use std::fs;
use std::process::Command;

/// Every thread, by what it waits for in the kernel, and its stack, where there is a debugger.
pub(crate) fn of(pid: u32) -> String {
    let mut text = String::new();
    let tasks = fs::read_dir(format!("/proc/{pid}/task"));
    for task in tasks.into_iter().flatten().flatten() {
        let read = |name| fs::read_to_string(task.path().join(name)).unwrap_or_default();
        let _ = write!(
            text,
            "\n    thread {}: waits in {}, system call {}",
            read("comm").trim(),
            read("wchan").trim(),
            read("syscall").trim()
        );
    }
    text + &stacks(pid)
}

fn stacks(pid: u32) -> String {
    let pid = pid.to_string();
    let arguments = ["-p", &pid, "-batch", "-ex", "thread apply all backtrace 12"];
    let Ok(output) = Command::new("gdb").args(arguments).output() else {
        return String::new();
    };
    let text = String::from_utf8_lossy(&output.stdout);
    let mut found = String::new();
    for line in text.lines() {
        if line.starts_with('#') || line.starts_with("Thread") {
            let start: String = line.chars().take(140).collect();
            let _ = write!(found, "\n    {start}");
        }
    }
    found
}
