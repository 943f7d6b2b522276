//! Derivatives by dual numbers against finite differences.

mod driver;

use driver::{drive, vehicle};
use vehicle::{Inputs, Outputs, Parameters};

/// The outputs as a list of numbers.
fn numbers(outputs: &Outputs) -> Vec<(&'static str, f64)> {
    let Outputs { v_x_true, v_y_true, yaw_rate_true, e_y_true, e_psi_true, x, y, psi, s, .. } = *outputs;
    let Outputs { a_lat, a_long, alpha_f, alpha_r, f_yf, f_yr, c_f_true, c_r_true, .. } = *outputs;
    let Outputs { delta_actual, a_x_actual, grip_usage, wind_speed_actual, .. } = *outputs;
    vec![
        ("v_x", v_x_true),
        ("v_y", v_y_true),
        ("yaw_rate", yaw_rate_true),
        ("e_y", e_y_true),
        ("e_psi", e_psi_true),
        ("x", x),
        ("y", y),
        ("psi", psi),
        ("s", s),
        ("a_lat", a_lat),
        ("a_long", a_long),
        ("alpha_f", alpha_f),
        ("alpha_r", alpha_r),
        ("f_yf", f_yf),
        ("f_yr", f_yr),
        ("c_f", c_f_true),
        ("c_r", c_r_true),
        ("delta", delta_actual),
        ("a_x", a_x_actual),
        ("grip_usage", grip_usage),
        ("wind", wind_speed_actual),
    ]
}

/// Asserts that `got` is the slope between `low` and `high`, `2 h` apart.
fn assert_slope(got: &Outputs, low: &Outputs, high: &Outputs, h: f64, case: &str) {
    for (((name, got), (_, low)), (_, high)) in numbers(got).into_iter().zip(numbers(low)).zip(numbers(high)) {
        let want = (high - low) / (2.0 * h);
        // Central differences at h = 1e-5: cancellation of 1e-11 of the value, and truncation of h^2/6 times the third
        // derivative, which the tyres' modes of 100 1/s make up to 1e6 times the value.
        let scale = 1.0 + want.abs() + high.abs();
        assert!((got - want).abs() < 2e-5 * scale, "{case}: d {name} = {got} for {want}");
    }
}

#[test]
fn derivatives_along_inputs_match_finite_differences() {
    let mut vehicle = vehicle("general", Parameters::default());
    drive(&mut vehicle, 100, 1, |_| ()).unwrap();
    let inputs = Inputs { wind_speed: 12.0, wind_direction: 1.1, mu_scale: 0.9, ..driver::command(&vehicle) };
    for seed in [
        Inputs { delta: 1.0, ..Inputs::ZERO },
        Inputs { a_x: 1.0, ..Inputs::ZERO },
        Inputs { wind_speed: 1.0, ..Inputs::ZERO },
        Inputs { wind_direction: 1.0, ..Inputs::ZERO },
        Inputs { mu_scale: 1.0, ..Inputs::ZERO },
        Inputs { delta: 0.3, a_x: -2.0, wind_speed: 4.0, wind_direction: 0.7, mu_scale: -0.4 },
    ] {
        let h = 1e-5;
        let got = vehicle.outputs_along(&inputs, &seed);
        let [low, high] = [-h, h].map(|h| vehicle.outputs_under(&inputs.after(h, &seed)));
        assert_slope(&got, &low, &high, h, &format!("{seed:?}"));
    }
}

#[test]
fn a_lagging_actuator_passes_no_command_at_once() {
    let vehicle = vehicle("general", Parameters { tau_delta: 0.1, ..Parameters::default() });
    let seed = Inputs { delta: 1.0, ..Inputs::ZERO };
    assert_eq!(vehicle.outputs_along(&Inputs::default(), &seed).a_lat, 0.0);
}

#[test]
fn derivatives_in_time_match_the_motion() {
    for parameters in [Parameters::default(), Parameters { tau_delta: 0.1, ..Parameters::default() }] {
        let mut vehicle = vehicle("general", parameters);
        drive(&mut vehicle, 100, 1, |_| ()).unwrap();
        let inputs = Inputs { delta: 0.05, a_x: -1.0, ..Inputs::default() };
        // Enter the motion under these inputs, so that no jump lies between the points of the difference.
        let h = 1e-5;
        vehicle.advance(h, &inputs).unwrap();
        let low = vehicle.outputs();
        vehicle.advance(h, &inputs).unwrap();
        let got = vehicle.outputs_rate(&inputs);
        vehicle.advance(h, &inputs).unwrap();
        assert_slope(&got, &low, &vehicle.outputs(), h, "time");
    }
}

#[test]
fn extrapolated_inputs_equal_many_small_steps() {
    // A ramp held over steps of 10 us has the mean of the true ramp if each holds the value of its middle.
    let rates = Inputs { delta: 0.4, a_x: -3.0, wind_speed: 20.0, wind_direction: 2.0, mu_scale: -0.5 };
    for tau in [0.0, 0.05] {
        let parameters = Parameters { tau_delta: tau, delay_a_x: 0.5 * tau, ..Parameters::default() };
        let mut whole = vehicle("general", parameters);
        let inputs = Inputs { wind_speed: 10.0, ..Inputs::default() };
        whole.advance(0.02, &inputs).unwrap();
        let mut parts = whole.clone();
        whole.advance_along(0.1, &inputs, &rates).unwrap();
        let h = 1e-5;
        for i in 0..10_000 {
            parts.advance(h, &inputs.after((f64::from(i) + 0.5) * h, &rates)).unwrap();
        }
        for (a, b) in whole.truth().x.iter().zip(parts.truth().x) {
            // The staircase of 10 us misses the ramp by its square at most.
            assert!((a - b).abs() < 1e-8, "tau {tau}: {a} for {b}");
        }
    }
}

#[test]
fn preview_rate_matches_the_motion() {
    // Half-way through the edges of a patch, whose friction then changes along the preview.
    let patch = Parameters { patch_start: 75.0, patch_length: 5.0, patch_edge: 20.0, ..Parameters::default() };
    let mut vehicle = vehicle("general", Parameters { e_y_0: 0.3, ..patch });
    drive(&mut vehicle, 150, 1, |_| ()).unwrap();
    let inputs = driver::command(&vehicle);
    let h = 1e-4;
    let low = vehicle.preview();
    vehicle.advance(h, &inputs).unwrap();
    let got = vehicle.preview_rate();
    vehicle.advance(h, &inputs).unwrap();
    let high = vehicle.preview();
    for j in 0..vehicle::PREVIEW {
        let want = (high.kappa_ref[j] - low.kappa_ref[j]) / (2.0 * h);
        // The table of places is good to 1e-8 m; over 2e-4 s and at curvature slopes of 1e-3 1/m2 that is 1e-7.
        assert!((got.kappa_ref[j] - want).abs() < 1e-6, "kappa_ref[{j}]: {} for {want}", got.kappa_ref[j]);
        let want = (high.v_x_ref[j] - low.v_x_ref[j]) / (2.0 * h);
        assert!((got.v_x_ref[j] - want).abs() < 1e-4, "v_x_ref[{j}]: {} for {want}", got.v_x_ref[j]);
        let want = (high.mu_ref[j] - low.mu_ref[j]) / (2.0 * h);
        assert!((got.mu_ref[j] - want).abs() < 1e-4, "mu_ref[{j}]: {} for {want}", got.mu_ref[j]);
    }
    assert!(got.mu_ref.iter().any(|rate| rate.abs() > 0.01), "no friction that changes");
}
