//! Driving allocates nothing: counted by the allocator itself.

mod driver;

use allocation_counter::measure;
use driver::{T_S, command, vehicle};
use vehicle::{Inputs, Parameters};

#[test]
fn steps_and_outputs_do_not_allocate() {
    assert_eq!(measure(|| drop(std::hint::black_box(Box::new(0)))).count_total, 1, "what is there is counted");
    let everything = Parameters {
        delay_delta: 0.05,
        delay_a_x: 0.03,
        tau_delta: 0.05,
        delta_rate_max: 0.5,
        noise_scale: 1.0,
        load_transfer: true,
        combined_slip: true,
        relaxation_length: 0.3,
        gust_speed: 5.0,
        patch_length: 10.0,
        grade: 0.01,
        ..Parameters::default()
    };
    for parameters in [Parameters::default(), everything] {
        for road in vehicle::road::NAMES {
            let original = vehicle(road, parameters.clone());
            // A restored copy must be as quiet as the original.
            for mut vehicle in [original.clone(), original] {
                let counted = measure(|| {
                    for step in 0..200_u32 {
                        let inputs = command(&vehicle);
                        let rates = Inputs { delta: 0.01, ..Inputs::ZERO };
                        let done = if step % 2 == 0 {
                            vehicle.advance(T_S, &inputs)
                        } else {
                            vehicle.advance_along(1e-3, &inputs, &rates)
                        };
                        done.unwrap();
                        std::hint::black_box((
                            vehicle.measurement(),
                            vehicle.outputs_rate(&inputs),
                            vehicle.preview_rate(),
                        ));
                        std::hint::black_box(vehicle.outputs_along(&inputs, &rates));
                    }
                });
                assert_eq!(counted.count_total, 0, "{road}");
            }
        }
    }
}
