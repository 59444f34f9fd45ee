//! Which payload a service carries that somebody else has opened, and how old the program must be that did.

use iceoryx2::prelude::{MessagingPattern, ServiceName};
use iceoryx2::service::Service as _;

use super::config::Place;
use super::transport;

/// The name of the type that travels on `service`, if that can be known.
pub(super) fn on(place: &Place, service: &ServiceName) -> Option<String> {
    let pattern = MessagingPattern::PublishSubscribe;
    let details = transport::Service::details(service, place.config(), pattern);
    let config = details.ok()??.static_details;
    let payload = &config.publish_subscribe().message_type_details().payload;
    Some(payload.type_name().to_string())
}

/// What the speaker of `theirs` is to the speaker of `ours`, by the versions at their ends.
pub(super) fn age(theirs: &str, ours: &str) -> &'static str {
    match (split(theirs), split(ours)) {
        (Some((name, theirs)), Some((same, ours))) if name == same && theirs < ours => "an older",
        (Some((name, theirs)), Some((same, ours))) if name == same && theirs > ours => "a newer",
        _ => "another",
    }
}

/// `coloc.Estimate.v2` as name and number.
fn split(name: &str) -> Option<(&str, u32)> {
    let (name, version) = name.rsplit_once(".v")?;
    Some((name, version.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::age;

    #[test]
    fn versions_tell_the_older_from_the_newer() {
        let ours = "coloc.Estimate.v2";
        for (theirs, expected) in [
            ("coloc.Estimate.v1", "an older"),
            ("coloc.Estimate.v10", "a newer"),
            ("coloc.Estimate.v2", "another"),
            ("coloc.Status.v1", "another"),
            ("geometry.Pose", "another"),
            ("", "another"),
        ] {
            assert_eq!(age(theirs, ours), expected, "{theirs}");
        }
    }
}
