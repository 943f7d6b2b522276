//! Pure pursuit: the arc through a point of the path ahead.

use lpv_mpc::{Inputs, Parameters};

use super::Law;

/// Distance ahead per speed [s], and at standstill [m]: the defaults of Autoware's simple pure pursuit.
const LOOK_AHEAD: (f64, f64) = (1.0, 1.0);

/// [Coulter]: steers the rear axle along the arc that meets the path at the look-ahead distance.
#[derive(Clone, Debug)]
pub struct PurePursuit {
    l_r: f64,
    wheelbase: f64,
    t_s: f64,
}

impl PurePursuit {
    /// The law for the car that the parameters describe.
    pub fn new(p: &Parameters) -> Self {
        Self { l_r: p.l_r, wheelbase: p.l_f + p.l_r, t_s: p.t_s }
    }
}

impl Law for PurePursuit {
    fn steer(&mut self, seen: &Inputs, _latency: f64, _delta: f64) -> f64 {
        let (sin, cos) = seen.e_psi.sin_cos();
        // Frame of the path where the car is now.
        let rear = [-self.l_r * cos, seen.e_y - self.l_r * sin];
        let distance = LOOK_AHEAD.0 * seen.v_x.max(0.0) + LOOK_AHEAD.1;
        let [x, y] = target(seen, self.t_s, rear, distance);
        let (ahead, aside) = (x - rear[0], y - rear[1]);
        let lateral = aside * cos - ahead * sin;
        let square = ahead * ahead + aside * aside;
        (2.0 * self.wheelbase * lateral / square).atan()
    }
}

/// Point of the path ahead at a distance from a place, both in the path's frame [m]; straight on beyond the preview.
fn target(seen: &Inputs, t_s: f64, from: [f64; 2], distance: f64) -> [f64; 2] {
    let away = |[x, y]: [f64; 2]| (x - from[0]).hypot(y - from[1]);
    let mut place = [0.0, 0.0];
    let mut heading = 0.0_f64;
    for i in 1..seen.kappa_ref.len() {
        let s = 0.5 * t_s * (seen.v_x_ref[i - 1] + seen.v_x_ref[i]);
        let turn = 0.5 * s * (seen.kappa_ref[i - 1] + seen.kappa_ref[i]);
        let (sin, cos) = (heading + 0.5 * turn).sin_cos();
        let next = [place[0] + s * cos, place[1] + s * sin];
        let (before, after) = (away(place), away(next));
        if after >= distance && after > before {
            let share = ((distance - before) / (after - before)).clamp(0.0, 1.0);
            return [place[0] + share * (next[0] - place[0]), place[1] + share * (next[1] - place[1])];
        }
        place = next;
        heading += turn;
    }
    let missing = (distance - away(place)).max(0.0);
    [place[0] + missing * heading.cos(), place[1] + missing * heading.sin()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn on_a_circle_the_arc_is_the_circle() {
        let p = Parameters::default();
        let (kappa, v_x) = (0.01_f64, 8.0);
        // The rear axle on the circle and tangent to it; the centre of gravity l_r ahead of it is a little outside.
        let radius = 1.0 / kappa;
        let out = radius.hypot(p.l_r) - radius;
        let mut seen = Inputs { v_x, e_y: -out, e_psi: -(p.l_r * kappa).atan(), ..Inputs::default() };
        seen.kappa_ref.fill(kappa);
        seen.v_x_ref.fill(v_x);
        let got = PurePursuit::new(&p).steer(&seen, 0.0, 0.0);
        let want = ((p.l_f + p.l_r) * kappa).atan();
        // The path is followed in chords of 0.26 m.
        assert!((got / want - 1.0).abs() < 1e-3, "{got} rad for {want} rad");
    }

    #[test]
    fn the_target_lies_at_the_distance_also_beyond_the_preview() {
        let mut seen = Inputs { v_x: 1.0, ..Inputs::default() };
        seen.v_x_ref.fill(1.0);
        for distance in [0.3, 1.0, 5.0] {
            let [x, y] = target(&seen, 0.033, [-0.1, 0.0], distance);
            assert!(((x + 0.1).hypot(y) - distance).abs() < 1e-12);
        }
    }
}
