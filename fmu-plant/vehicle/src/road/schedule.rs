//! When the reference passes each place of a road, and where it is at each time.

use super::Profile;

/// The reference never counts as slower than this, so that a standing road still has a schedule [m/s].
const V_MIN: f64 = 0.1;

/// Grid of the place over time [s]; the reference's acceleration changes over seconds.
const STEP: f64 = 0.01;
/// Cells of that grid at most: on a road that takes more than five hours to drive they are longer.
const CELLS_MAX: f64 = 2e6;

/// Time over place and place over time of a reference that drives the road's speed.
#[derive(Debug, Clone)]
pub struct Schedule {
    length: f64,
    closed: bool,
    duration: f64,
    /// Speed held beyond the end [m/s].
    end_speed: f64,
    speed: Profile,
    time: Profile,
    place: Profile,
}

impl Schedule {
    /// Integrates the speed profile.
    #[must_use]
    pub fn new(v_x: &Profile, length: f64, closed: bool) -> Self {
        let speed = |s: f64| v_x.at(s).max(V_MIN);
        // Simpson's rule per cell; the cells are those of the profile or finer.
        let step = 0.1_f64;
        let mut s_done = 0.0;
        let mut elapsed = 0.0;
        let time = Profile::new(length, step, |s| {
            let h = s - s_done;
            let slowness = |part: f64| 1.0 / speed(s_done + part * h);
            elapsed += h / 6.0 * (slowness(0.0) + 4.0 * slowness(0.5) + slowness(1.0));
            s_done = s;
            (elapsed, 1.0 / speed(s))
        });
        let duration = time.at(length);
        let mut t_done = 0.0;
        let mut s = 0.0;
        let place = Profile::new(duration, STEP.max(duration / CELLS_MAX), |t| {
            let h = t - t_done;
            // s' depends on s alone; a few Newton steps on the tabulated time keep both tables each other's inverse.
            s += h * speed(s);
            for _ in 0..3 {
                s += (t - time.at(s)) * speed(s);
                s = s.clamp(0.0, length);
            }
            t_done = t;
            (s, speed(s))
        });
        Self { length, closed, duration, end_speed: v_x.at(length), speed: v_x.clone(), time, place }
    }

    /// Speed of the reference at `s` [m/s]; never 0.
    #[must_use]
    pub fn speed(&self, s: f64) -> f64 {
        self.speed.at(s).max(V_MIN)
    }

    /// Time at which the reference reaches the end [s].
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// Time at which the reference passes `s` [s]; beyond the end at the speed held there, or in the next lap.
    #[must_use]
    pub fn time(&self, s: f64) -> f64 {
        if self.closed {
            let lap = (s / self.length).floor();
            lap * self.duration + self.time.at(s - lap * self.length)
        } else if s > self.length {
            self.duration + (s - self.length) / self.end_speed.max(V_MIN)
        } else {
            self.time.at(s)
        }
    }

    /// Where the reference is at time `t` [m].
    #[must_use]
    pub fn place(&self, t: f64) -> f64 {
        if self.closed {
            let lap = (t / self.duration).floor();
            lap * self.length + self.place.at(t - lap * self.duration)
        } else if t > self.duration {
            self.length + (t - self.duration) * self.end_speed.max(V_MIN)
        } else {
            self.place.at(t)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn place_and_time_are_inverse() {
        // v = 5 + s / 10, so t = 10 ln(1 + s / 50).
        let v_x = Profile::new(200.0, 0.1, |s| (5.0 + s / 10.0, 0.1));
        let schedule = Schedule::new(&v_x, 200.0, false);
        for i in 0..200 {
            let s = f64::from(i);
            let t = 10.0 * (1.0 + s / 50.0).ln();
            assert!((schedule.time(s) - t).abs() < 1e-8, "time at {s} m: {} for {t}", schedule.time(s));
            assert!((schedule.place(t) - s).abs() < 1e-7, "place at {t} s: {} for {s}", schedule.place(t));
        }
    }

    #[test]
    fn standing_road_has_a_schedule() {
        let v_x = Profile::new(10.0, 0.1, |_| (0.0, 0.0));
        let schedule = Schedule::new(&v_x, 10.0, false);
        assert!((schedule.duration() - 10.0 / V_MIN).abs() < 1e-9);
        assert!(schedule.place(schedule.time(3.0) + 1.0) < 3.11);
    }
}
