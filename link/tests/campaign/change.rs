//! A team that changes while it runs.
use coloc_link::roster::{Moment, Role};

use crate::Extent;
use crate::support::{member, name, roster, wall_ns};
use crate::talk::Talk;
use crate::team::{Robot, members, team};

const NEWCOMER: u16 = 6;

/// Five robots: one is added, all are renewed, the newcomer is revoked, each link is exchanged in turn.
pub(crate) fn one_by_one(extent: Extent) {
    let home = tempfile::tempdir().unwrap();
    let mut robots = team(home.path(), 5);
    robots.iter_mut().for_each(Robot::start_link);
    let mut talk = Talk::new(&robots, |_, _| true, 10.0);
    talk.until_all_are_heard();
    talk.go_on(extent.of(1.0, 5.0));
    let own = members(&robots);
    let mut with = own.clone();
    with.push(member(NEWCOMER, Role::Robot, None));
    let mut renewed = with.clone();
    for member in &mut renewed {
        member.expires = Moment::of_ns(wall_ns()).later(7200);
    }
    let mut kept = renewed.clone();
    kept.retain(|it| it.name != name(NEWCOMER));
    for (version, (what, listed)) in
        (2..).zip([("add", with), ("renew", renewed), ("revoke", kept)])
    {
        talk.forget();
        // To one of them; the links hand it on.
        robots[2].goes_by(&roster(version, listed));
        talk.go_on(extent.of(2.5, 5.0));
        println!(
            "change: {what}: nobody was without help for longer than {:.2} s",
            talk.longest_gap_s(None)
        );
    }
    for place in 0..extent.of(2, robots.len()) {
        let id = robots[place].id;
        talk.forget();
        robots[place].link.as_mut().unwrap().end();
        robots[place].start_link();
        talk.go_on(extent.of(3.0, 6.0));
        let of = |but| talk.longest_gap_s(but);
        println!(
            "change: the link of robot {id} is exchanged: its own pairs were without help for {:.2} s at most, the others' for {:.2} s",
            of(None),
            of(Some(id))
        );
        talk.until_all_are_heard();
    }
}
