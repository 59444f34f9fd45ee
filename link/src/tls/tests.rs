//! Handshakes in memory.
use rustls::{ClientConnection, ServerConnection};

use super::*;

#[derive(Debug)]
struct These(Vec<PublicKey>);

impl Members for These {
    fn admits(&self, key: &PublicKey) -> bool {
        self.0.contains(key)
    }
}

fn these(keys: &[&Identity]) -> Arc<dyn Members> {
    Arc::new(These(keys.iter().map(|key| key.public()).collect()))
}

/// Plays a handshake to its end, and gives back whom each side has met.
fn shake(client: ClientConfig, server: ServerConfig) -> Result<[Option<PublicKey>; 2], Error> {
    let name = ServerName::try_from("coloc").unwrap();
    let mut client = ClientConnection::new(Arc::new(client), name)?;
    let mut server = ServerConnection::new(Arc::new(server))?;
    let mut wire = Vec::new();
    while client.is_handshaking() || server.is_handshaking() {
        wire.clear();
        client.write_tls(&mut wire).unwrap();
        server.read_tls(&mut wire.as_slice()).unwrap();
        server.process_new_packets()?;
        wire.clear();
        server.write_tls(&mut wire).unwrap();
        client.read_tls(&mut wire.as_slice()).unwrap();
        client.process_new_packets()?;
    }
    let met = [client.peer_certificates(), server.peer_certificates()];
    Ok(met.map(|shown| proven_key(&shown?[0])))
}

#[test]
fn members_meet_and_know_each_other() {
    let [one, two] = [1, 2].map(|seed| Identity::of_seed(&[seed; 32]));
    let all = these(&[&one, &two]);
    let met = shake(
        client(&one, all.clone()).unwrap(),
        server(&two, all).unwrap(),
    );
    assert_eq!(met.unwrap(), [Some(two.public()), Some(one.public())]);
}

#[test]
fn a_strangers_key_is_refused_on_either_side() {
    let [one, two, stranger] = [1, 2, 3].map(|seed| Identity::of_seed(&[seed; 32]));
    let team = these(&[&one, &two]);
    let anybody = these(&[&one, &two, &stranger]);
    let calls = shake(
        client(&stranger, anybody.clone()).unwrap(),
        server(&two, team.clone()).unwrap(),
    );
    assert!(calls.is_err());
    let called = shake(
        client(&one, team).unwrap(),
        server(&stranger, anybody).unwrap(),
    );
    assert!(called.is_err());
}

#[test]
fn who_shows_no_key_is_refused() {
    let [one, two] = [1, 2].map(|seed| Identity::of_seed(&[seed; 32]));
    let all = these(&[&one, &two]);
    let mut mute = client(&one, all.clone()).unwrap();
    mute.client_auth_cert_resolver = Arc::new(NoKey);
    assert!(shake(mute, server(&two, all).unwrap()).is_err());
}

#[derive(Debug)]
struct NoKey;

impl client::ResolvesClientCert for NoKey {
    fn resolve(&self, _: &[&[u8]], _: &[SignatureScheme]) -> Option<Arc<CertifiedKey>> {
        None
    }

    fn has_certs(&self) -> bool {
        false
    }
}
