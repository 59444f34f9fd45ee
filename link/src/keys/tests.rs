//! Keys on disk.
use super::*;

#[test]
fn a_key_that_is_written_is_read_again_and_never_overwritten() {
    let home = tempfile::tempdir().unwrap();
    let directory = home.path().join("robot1");
    let key = Identity::generate().unwrap();
    key.save(&directory, ROBOT_KEY).unwrap();
    let mode = |path: &Path| path.metadata().unwrap().permissions().mode() & 0o7777;
    assert_eq!(mode(&directory), 0o700);
    assert_eq!(mode(&directory.join(ROBOT_KEY)), 0o600);
    let again = Identity::load(&directory, ROBOT_KEY).unwrap();
    assert_eq!(again.public(), key.public());
    let refused = Identity::generate().unwrap().save(&directory, ROBOT_KEY);
    assert!(matches!(refused, Err(KeyError::There(_))));
    assert_eq!(
        Identity::load(&directory, ROBOT_KEY).unwrap().public(),
        key.public()
    );
}

#[test]
fn a_key_that_others_can_read_is_refused() {
    let home = tempfile::tempdir().unwrap();
    let key = Identity::generate().unwrap();
    key.save(home.path(), ROBOT_KEY).unwrap();
    let file = home.path().join(ROBOT_KEY);
    std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o640)).unwrap();
    let refused = Identity::load(home.path(), ROBOT_KEY);
    assert!(matches!(refused, Err(KeyError::Open { mode: 0o640, .. })));
}

#[test]
fn what_is_missing_or_cut_is_no_key() {
    let home = tempfile::tempdir().unwrap();
    let missing = Identity::load(home.path(), ROBOT_KEY);
    assert!(matches!(missing, Err(KeyError::Missing(_))));
    let missing = Identity::load(&home.path().join("nowhere"), ROBOT_KEY);
    assert!(matches!(missing, Err(KeyError::Missing(_))));
    let key = Identity::generate().unwrap();
    key.save(home.path(), ROBOT_KEY).unwrap();
    let file = home.path().join(ROBOT_KEY);
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, &text[..text.len() - 3]).unwrap();
    let cut = Identity::load(home.path(), ROBOT_KEY);
    assert!(matches!(cut, Err(KeyError::NotAKey(_))));
}

#[test]
fn a_public_key_is_its_text() {
    let key = Identity::of_seed(&[7; 32]).public();
    assert_eq!(key.to_string().parse(), Ok(key));
    assert_eq!("12".parse::<PublicKey>(), Err(NotAKey));
    // The neutral element: everything is signed by it.
    let weak = hex(&[&[1][..], &[0; 31]].concat());
    assert_eq!(weak.parse::<PublicKey>(), Err(NotAKey));
}

#[test]
fn nothing_printed_holds_the_private_key() {
    let key = Identity::of_seed(&[7; 32]);
    assert!(!format!("{key:?}").contains(&hex(&[7; 32])));
}
