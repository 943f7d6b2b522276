//! How much dearer steering is when the car is fast and commands are under way for long.
//!
//! A steering angle gives `v_x^2 / L` times itself as lateral acceleration. A weight on the steering's increments that is the
//! same at all speeds therefore weighs those of the acceleration by `v_x^-4`: the faster the car, the faster the loop closes. The
//! prediction over the latency makes up for a latency that is known; what remains of it, unknown, and of a car that is not
//! the believed one, swings up when the loop closes faster than its commands arrive. So the weight rises as `v_x^4`, and in
//! proportion to what the latency has over [`LATENCY`]; where that would be less than the weight given, it does not.
//!
//! Measured on the general track, up to 25 m/s, and on the straight in a gust, with delays of 0.1 to 0.25 s that are assumed
//! right or 20 ms wrong (`cargo fmu robustness --case fast_wrong`, `--case fast_gust`): without this the car is lost with delays
//! from 0.15 s on that are assumed too short, and leaves the path by 0.7 m and more where those are assumed too long; with it
//! by at most 30 cm. On the general track a delay of 0.25 s that is assumed right costs 1.7 cm with it and 0.7 without. Lags
//! count for nothing here: they are slow, but never late.

/// Speed up to which the weight holds at twice [`LATENCY`] [m/s].
///
/// With 15 m/s one of the 48 situations of `cargo fmu robustness --weights` leaves the road (lag and delay of 0.2 s, assumed
/// wrong), with 13 the general track with a delay of 0.25 s that is assumed wrong grows from 30 to 32 cm.
const SPEED: f64 = 14.0;

/// Latency that asks for no caution at any speed [s]: one period and a usual steering's delay. At 25 m/s and 70 ms that are
/// assumed to be 50 the car stays within 1 cm in a gust of 20 m/s.
const LATENCY: f64 = 0.05;

/// Factor on the weight of the steering increments at speed `v_x` [m/s], when a command acts `latency` [s] after the
/// measurement that it follows from.
pub fn caution(v_x: f64, latency: f64) -> f64 {
    let gain = (v_x / SPEED).powi(4);
    (gain * (latency / LATENCY - 1.0)).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_latency_or_slowly_the_weights_are_those_given() {
        for (v_x, latency) in [(50.0, 0.034), (50.0, 0.0), (14.0, 0.1), (5.0, 0.3), (0.0, 1.0), (-2.0, 0.1)] {
            assert_eq!(caution(v_x, latency), 1.0, "{v_x} m/s, {latency} s");
        }
    }

    #[test]
    fn the_weight_rises_without_a_step() {
        let mut before = caution(0.0, 0.2);
        for k in 1..=4000 {
            let now = caution(f64::from(k) * 0.01, 0.2);
            // d/dv of v^4 at 40 m/s is a tenth of it per m/s.
            assert!(now >= before && now <= before * 1.01, "{k}: {before} to {now}");
            before = now;
        }
        assert!(before > 100.0);
    }
}
