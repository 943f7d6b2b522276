//! Network files that somebody damaged or made up: refused, or a network that answers with numbers.

use lpv_mpc::jordan::{Document, Measured, Network};
use proptest::prelude::*;

const SHIPPED: &str = include_str!("../../resources/jordan_paper_size.json");
const TURN: Measured =
    Measured { v_x: 16.0, v_y: -0.3, yaw_rate: 0.4, delta: 0.06, a_x: 1.0, a_y: 0.0, yaw_acceleration: 0.0 };

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_changed_file_is_refused(at in 0..SHIPPED.len(), byte in 0x20_u8..0x7f) {
        let mut text = SHIPPED.as_bytes().to_vec();
        text[at] = byte;
        let text = String::from_utf8(text).expect("ASCII stays ASCII");
        // Blanks between values and digits behind the last one that matters change nothing that the checksum sees.
        if let Ok(network) = Network::from_json(&text) {
            prop_assert_eq!(network, Network::from_json(SHIPPED).expect("the shipped network is valid"));
        }
    }

    #[test]
    fn a_file_cut_short_is_refused(end in 0..SHIPPED.trim_end().len()) {
        prop_assert!(Network::from_json(&SHIPPED[..end]).is_err());
    }

    #[test]
    fn text_that_is_no_network_is_refused(text in "\\PC{0,200}") {
        prop_assert!(Network::from_json(&text).is_err());
    }

    /// The checksum is right in these: only what the numbers themselves say can refuse them.
    #[test]
    fn numbers_of_any_size_never_give_an_answer_that_is_no_number(
        layer in 0_usize..3,
        value in any::<f64>(),
        scale in any::<f64>(),
        row in 0_usize..2,
    ) {
        let mut document: Document = Network::from_json(SHIPPED).expect("the shipped network is valid").into();
        document.layers[layer].weights[row][1] = value;
        document.inputs[row].deviation = scale;
        let Ok(network) = Network::try_from(document) else { return Ok(()) };
        let mut memory = network.nominal();
        for _ in 0..5 {
            memory = network.step(&memory, &TURN);
            let (next, belief) = network.linearise(&memory, &TURN);
            prop_assert!(memory.c_f.is_finite() && memory.c_r.is_finite());
            prop_assert!(next.c_f.is_finite() && next.c_r.is_finite());
            prop_assert!((0.0..=1.0).contains(&belief.confidence));
        }
    }
}
