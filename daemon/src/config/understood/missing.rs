//! What is not configured, and what that means.

use super::super::Config;
use super::super::others::OTHERS;
use super::page::Page;

pub(super) fn write(config: &Config, page: &mut Page) {
    let (files, odometry) = (&config.telemetry, &config.odometry);
    let is_alone = config.peers().next().is_none();
    let unproven = odometry.as_ref().is_some_and(|odometry| {
        let is_own = odometry.dbc.is_none();
        !is_own && odometry.is_on_can() && odometry.messages.is_empty()
    });
    let missing = [
        (odometry.is_none(), "[odometry]: no wheels are heard"),
        (
            is_alone,
            "[[team]]: no other robot is heard or told anything",
        ),
        (
            unproven,
            "[[odometry.messages]]: no frame proves that it is new and whole",
        ),
        (
            !config.initial.resume,
            "initial.resume: every start is at initial.pose, nothing is saved",
        ),
        (
            files.record.as_os_str().is_empty(),
            "telemetry.record: nothing is recorded",
        ),
        (
            files.log_file.as_os_str().is_empty(),
            "telemetry.log_file: the log goes to standard error",
        ),
        (
            config.realtime.cpus.is_empty(),
            "realtime.cpus: the tick may run on any processor",
        ),
    ];
    let missing = missing.into_iter().filter(|(is_missing, _)| *is_missing);
    page.lines("not set", missing.map(|(_, text)| text.to_owned()));
    let others = OTHERS.iter().filter(|other| (other.is_in)(config));
    let others = others.map(|other| format!("[{}]: see {}", other.name, other.program));
    page.lines("not colocd's", others);
}
