//! The state of an instance, and its form as bytes that can be stored, checked and read back by another process.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::clock::Clock;
use crate::error::Error;
use crate::guid;
use crate::lifecycle::Phase;
use crate::model::{InputDerivative, Model};

/// Everything that the future of an instance depends on, except for what belongs to the importer (name, logger, resources).
#[derive(Clone, Serialize, Deserialize)]
#[serde(bound = "")]
pub(crate) struct State<M: Model> {
    pub model: M,
    pub phase: Phase,
    pub clock: Clock,
    pub input_derivatives: Vec<InputDerivative>,
    /// `Model::initialize` succeeded.
    pub initialised: bool,
    /// Tunable parameters were set since the last step.
    pub retune: bool,
    /// Something changed since `Model::refresh`.
    pub stale: bool,
}

impl<M: Model> Default for State<M> {
    fn default() -> Self {
        Self {
            model: M::default(),
            phase: Phase::Instantiated,
            clock: Clock::default(),
            input_derivatives: Vec::new(),
            initialised: false,
            retune: false,
            stale: true,
        }
    }
}

// Layout: magic, format version, GUID, length of the payload, SHA-256 of all the former and the payload, payload (postcard).
const MAGIC: [u8; 8] = *b"FMUSTATE";
const VERSION: u32 = 1;
const LENGTH_AT: usize = MAGIC.len() + size_of::<u32>() + guid::LEN;
const DIGEST_AT: usize = LENGTH_AT + size_of::<u64>();
const PAYLOAD_AT: usize = DIGEST_AT + 32;

impl<M: Model> State<M> {
    pub fn to_bytes(&self) -> Result<Vec<u8>, Error> {
        let payload = postcard::to_stdvec(self).map_err(|error| Error::State(error.to_string()))?;
        let mut bytes = Vec::with_capacity(PAYLOAD_AT + payload.len());
        bytes.extend_from_slice(&header::<M>());
        bytes.extend_from_slice(&(payload.len() as u64).to_le_bytes());
        let digest = digest(&bytes, &payload);
        bytes.extend_from_slice(&digest);
        bytes.extend_from_slice(&payload);
        Ok(bytes)
    }

    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let refuse = |reason: &str| Err(Error::State(reason.to_owned()));
        if bytes.len() < PAYLOAD_AT {
            return refuse("it is shorter than its header");
        }
        let expected = header::<M>();
        if bytes[..MAGIC.len()] != MAGIC {
            return refuse("it does not begin as a saved state does");
        }
        if bytes[..LENGTH_AT] != expected {
            return refuse("it belongs to another model or version");
        }
        let length: [u8; 8] = bytes[LENGTH_AT..DIGEST_AT].try_into().expect("the header's length field has 8 bytes");
        let payload = &bytes[PAYLOAD_AT..];
        if u64::from_le_bytes(length) != payload.len() as u64 {
            return refuse("its length is not the one it was saved with");
        }
        if bytes[DIGEST_AT..PAYLOAD_AT] != digest(&bytes[..DIGEST_AT], payload) {
            return refuse("its checksum does not match");
        }
        postcard::from_bytes(payload).map_err(|error| Error::State(error.to_string()))
    }
}

fn header<M: Model>() -> [u8; LENGTH_AT] {
    let mut header = [0; LENGTH_AT];
    header[..MAGIC.len()].copy_from_slice(&MAGIC);
    header[MAGIC.len()..MAGIC.len() + 4].copy_from_slice(&VERSION.to_le_bytes());
    header[MAGIC.len() + 4..].copy_from_slice(guid::guid::<M>().as_bytes());
    header
}

fn digest(header: &[u8], payload: &[u8]) -> [u8; 32] {
    Sha256::new().chain_update(header).chain_update(payload).finalize().into()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::model::{Experiment, Info, Log, Outcome, Step};
    use crate::table::Table;

    /// Lengths, options and text in one model: what a decoder can trip over.
    #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
    struct Awkward {
        list: Vec<f64>,
        text: String,
        choice: Option<Box<Awkward>>,
    }

    impl Model for Awkward {
        const INFO: Info =
            Info { name: "Awkward", identifier: "awkward", description: "Hard to decode", ..Info::PLAIN };
        type Error = String;

        fn table() -> &'static Table<Self> {
            crate::variables! { Awkward; Parameter text "Any text" => text; }
        }

        fn initialize(&mut self, _: &Experiment<'_>, _: &mut dyn Log) -> Result<(), String> {
            Ok(())
        }

        fn step(&mut self, _: &Step<'_>, _: &mut dyn Log) -> Result<Outcome, String> {
            Ok(Outcome::Ok)
        }
    }

    /// Header and checksum as they should be, around any payload.
    fn sealed(payload: &[u8]) -> Vec<u8> {
        let mut bytes = header::<Awkward>().to_vec();
        bytes.extend_from_slice(&(payload.len() as u64).to_le_bytes());
        let digest = digest(&bytes, payload);
        bytes.extend_from_slice(&digest);
        bytes.extend_from_slice(payload);
        bytes
    }

    #[test]
    fn a_state_comes_back_from_its_bytes() {
        let inner = Awkward { list: vec![-0.0, f64::MIN_POSITIVE], ..Awkward::default() };
        let model = Awkward { text: "ü".to_owned(), choice: Some(Box::new(inner)), ..Awkward::default() };
        let state = State { model: model.clone(), ..State::default() };
        let bytes = state.to_bytes().unwrap();
        let back = State::<Awkward>::from_bytes(&bytes).unwrap();
        assert_eq!(back.model, model);
        assert_eq!(back.to_bytes().unwrap(), bytes);
    }

    proptest! {
        /// A checksum protects from accidents, not from a sender who computes it: the decoder must hold by itself.
        #[test]
        fn any_sealed_payload_is_decoded_or_refused(payload in prop::collection::vec(any::<u8>(), 0..200)) {
            if let Ok(state) = State::<Awkward>::from_bytes(&sealed(&payload)) {
                prop_assert!(state.to_bytes().is_ok());
            }
        }
    }
}
