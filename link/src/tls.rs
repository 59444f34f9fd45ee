//! TLS 1.3 with nothing but the robots' own keys: both sides prove theirs, and the roster says whether it is somebody's.
use std::fmt::Debug;
use std::sync::Arc;

use rustls::client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier};
use rustls::crypto::{
    CryptoProvider, WebPkiSupportedAlgorithms, ring, verify_tls13_signature_with_raw_key,
};
use rustls::pki_types::{
    CertificateDer, PrivateKeyDer, PrivatePkcs8KeyDer, ServerName, SubjectPublicKeyInfoDer,
    UnixTime,
};
use rustls::server::danger::{ClientCertVerified, ClientCertVerifier};
use rustls::sign::CertifiedKey;
use rustls::{
    CertificateError, ClientConfig, DigitallySignedStruct, DistinguishedName, Error, ServerConfig,
    SignatureScheme, client, server, version,
};

use crate::keys::{Identity, PublicKey};

/// The name of the protocol in the handshake (ALPN).
pub const PROTOCOL: &[u8] = b"coloc-link";

/// What an Ed25519 public key begins with as a `SubjectPublicKeyInfo` (RFC 8410).
const PREFIX: [u8; 12] = [
    0x30, 0x2a, 0x30, 0x05, 0x06, 0x03, 0x2b, 0x65, 0x70, 0x03, 0x21, 0x00,
];

/// Whose keys are let in: asked at every handshake, so that the newest roster decides.
pub trait Members: Debug + Send + Sync {
    /// Whether the key is a member's.
    fn admits(&self, key: &PublicKey) -> bool;
}

/// The key that the other side has proved, from what TLS holds of it.
#[must_use]
pub fn proven_key(shown: &CertificateDer<'_>) -> Option<PublicKey> {
    let key = shown.strip_prefix(&PREFIX)?.try_into().ok()?;
    PublicKey::of(key).ok()
}

/// For the side that is called.
///
/// # Errors
/// If TLS does not take the key.
pub fn server(own: &Identity, members: Arc<dyn Members>) -> Result<ServerConfig, Error> {
    let provider = Arc::new(ring::default_provider());
    let shown = shown(own, &provider)?;
    let verifier = Arc::new(Verifier::new(members, &provider));
    let mut config = ServerConfig::builder_with_provider(provider)
        .with_protocol_versions(&[&version::TLS13])?
        .with_client_cert_verifier(verifier)
        .with_cert_resolver(Arc::new(server::AlwaysResolvesServerRawPublicKeys::new(
            shown,
        )));
    config.alpn_protocols = vec![PROTOCOL.to_vec()];
    // Who comes back proves its key again: a session that is taken up would not ask the roster.
    config.send_tls13_tickets = 0;
    config.max_early_data_size = 0;
    Ok(config)
}

/// For the side that calls. Its verifier takes every member; who was called is asked of [`proven_key`] afterwards.
///
/// # Errors
/// If TLS does not take the key.
pub fn client(own: &Identity, members: Arc<dyn Members>) -> Result<ClientConfig, Error> {
    let provider = Arc::new(ring::default_provider());
    let shown = shown(own, &provider)?;
    let verifier = Arc::new(Verifier::new(members, &provider));
    let mut config = ClientConfig::builder_with_provider(provider)
        .with_protocol_versions(&[&version::TLS13])?
        .dangerous()
        .with_custom_certificate_verifier(verifier)
        .with_client_cert_resolver(Arc::new(client::AlwaysResolvesClientRawPublicKeys::new(
            shown,
        )));
    config.alpn_protocols = vec![PROTOCOL.to_vec()];
    config.resumption = client::Resumption::disabled();
    Ok(config)
}

fn shown(own: &Identity, provider: &CryptoProvider) -> Result<Arc<CertifiedKey>, Error> {
    let private = PrivateKeyDer::Pkcs8(PrivatePkcs8KeyDer::from(own.pkcs8()));
    let key = provider.key_provider.load_private_key(private)?;
    let public = [&PREFIX[..], own.public().bytes()].concat();
    Ok(Arc::new(CertifiedKey::new(
        vec![CertificateDer::from(public)],
        key,
    )))
}

#[derive(Debug)]
struct Verifier {
    members: Arc<dyn Members>,
    algorithms: WebPkiSupportedAlgorithms,
}

impl Verifier {
    fn new(members: Arc<dyn Members>, provider: &CryptoProvider) -> Self {
        Self {
            members,
            algorithms: provider.signature_verification_algorithms,
        }
    }

    fn check(&self, shown: &CertificateDer<'_>) -> Result<(), Error> {
        let key = proven_key(shown).ok_or(CertificateError::BadEncoding)?;
        let known = self.members.admits(&key);
        let refused = CertificateError::ApplicationVerificationFailure;
        known.then_some(()).ok_or(refused.into())
    }

    fn check_signature(
        &self,
        message: &[u8],
        shown: &CertificateDer<'_>,
        signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        let key = SubjectPublicKeyInfoDer::from(shown.as_ref());
        verify_tls13_signature_with_raw_key(message, &key, signature, &self.algorithms)
    }

    fn never() -> Result<HandshakeSignatureValid, Error> {
        Err(Error::General("TLS 1.3 alone is spoken".into()))
    }
}

impl ServerCertVerifier for Verifier {
    fn verify_server_cert(
        &self,
        shown: &CertificateDer<'_>,
        _: &[CertificateDer<'_>],
        _: &ServerName<'_>,
        _: &[u8],
        _: UnixTime,
    ) -> Result<ServerCertVerified, Error> {
        self.check(shown).map(|()| ServerCertVerified::assertion())
    }

    fn verify_tls12_signature(
        &self,
        _: &[u8],
        _: &CertificateDer<'_>,
        _: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        Self::never()
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        shown: &CertificateDer<'_>,
        signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        self.check_signature(message, shown, signature)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        vec![SignatureScheme::ED25519]
    }

    fn requires_raw_public_keys(&self) -> bool {
        true
    }
}

impl ClientCertVerifier for Verifier {
    fn root_hint_subjects(&self) -> &[DistinguishedName] {
        &[]
    }

    fn verify_client_cert(
        &self,
        shown: &CertificateDer<'_>,
        _: &[CertificateDer<'_>],
        _: UnixTime,
    ) -> Result<ClientCertVerified, Error> {
        self.check(shown).map(|()| ClientCertVerified::assertion())
    }

    fn verify_tls12_signature(
        &self,
        _: &[u8],
        _: &CertificateDer<'_>,
        _: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        Self::never()
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        shown: &CertificateDer<'_>,
        signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        self.check_signature(message, shown, signature)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        vec![SignatureScheme::ED25519]
    }

    fn requires_raw_public_keys(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests;
