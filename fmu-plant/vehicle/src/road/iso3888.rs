//! The lane changes of ISO 3888: lanes between cones, and a planned line through their middles.

use super::{Pose, Profile, Tables, lane_change::from_lateral};
use crate::smooth::{step, step_derivatives};

/// Straight before the first lane and after the last one [m].
const RUN: f64 = 40.0;
/// Distance of neighbouring cones of one lane's edge [m], at most.
const SPACING: f64 = 3.0;
/// How far a transition of the planned line reaches into the outer lanes and into the middle one [m]. The sum lowers the
/// curvature; of its divisions this one keeps the corners of a car of 1.77 m farthest from the cones of ISO 3888-2
/// (0.13 m, against 0.04 m with equal shares), measured by sweeping the body along the line.
const REACH: (f64, f64) = (3.0, 5.0);

/// Three lanes one after the other, with gaps in which the car changes over.
pub(super) struct Course {
    /// Begin and end of each lane, from the first cone on [m].
    lanes: [(f64, f64); 3],
    /// Right and left edge of each lane over the right edge of the first one [m].
    edges: [(f64, f64); 3],
}

impl Course {
    /// ISO 3888-1 for a vehicle of width `b` [m]: the right edge of the second lane is offset by 3.5 m.
    pub fn first(b: f64) -> Self {
        let [one, two, three] = [1.1, 1.2, 1.3].map(|factor| factor * b + 0.25);
        Self { lanes: [(0.0, 15.0), (45.0, 70.0), (95.0, 125.0)], edges: [(0.0, one), (3.5, 3.5 + two), (0.0, three)] }
    }

    /// ISO 3888-2 for a vehicle of width `b` [m]: 1 m between the left edge of the first lane and the right edge of the
    /// second; the third lane is at least 3 m wide.
    pub fn second(b: f64) -> Self {
        let one = 1.1 * b + 0.25;
        Self {
            lanes: [(0.0, 12.0), (25.5, 36.5), (49.0, 61.0)],
            edges: [(0.0, one), (one + 1.0, one + 1.0 + b + 1.0), (0.0, (1.3 * b + 0.25).max(3.0))],
        }
    }

    /// Middle of a lane, seen from the middle of the first [m].
    fn middle(&self, lane: usize) -> f64 {
        0.5 * (self.edges[lane].0 + self.edges[lane].1 - self.edges[0].0 - self.edges[0].1)
    }

    /// The planned line at `x` from the first cone on: lateral position and three derivatives.
    fn line(&self, x: f64) -> [f64; 4] {
        let mut y = [0.0; 4];
        for lane in 1..3 {
            let (leave, enter) = if lane == 1 { REACH } else { (REACH.1, REACH.0) };
            let (from, to) = (self.lanes[lane - 1].1 - leave, self.lanes[lane].0 + enter);
            let (t, length) = ((x - from) / (to - from), to - from);
            let rise = self.middle(lane) - self.middle(lane - 1);
            let [first, second, third] = step_derivatives(t);
            y[0] += rise * step(t);
            y[1] += rise * first / length;
            y[2] += rise * second / length.powi(2);
            y[3] += rise * third / length.powi(3);
        }
        y
    }

    /// Cones along both edges of every lane, seen from the first cone and the middle of the first lane.
    fn cones(&self) -> Vec<[f64; 2]> {
        let origin = 0.5 * (self.edges[0].0 + self.edges[0].1);
        let mut cones = Vec::new();
        for ((from, to), (right, left)) in self.lanes.into_iter().zip(self.edges) {
            let gaps = ((to - from) / SPACING).ceil();
            let mut i = 0.0;
            while i <= gaps {
                let x = from + (to - from) * i / gaps;
                cones.extend([[x, right - origin], [x, left - origin]]);
                i += 1.0;
            }
        }
        cones
    }
}

/// A course at a constant speed [m/s].
pub(super) fn tables(course: &Course, speed: f64) -> Tables {
    let end = course.lanes[2].1 + RUN;
    // The line is longer than its projection by less than a metre; the rest is straight.
    let length = (RUN + end).ceil();
    let kappa = from_lateral(-RUN, length, |x| course.line(x));
    Tables {
        cones: course.cones().into_iter().map(|[x, y]| [x + RUN, y]).collect(),
        start: Pose::default(),
        ..Tables::plain(length, kappa, Profile::new(length, length, |_| (speed, 0.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_course_has_the_lengths_of_the_standard() {
        let course = Course::first(1.8);
        let lengths: Vec<f64> = course.lanes.iter().map(|(from, to)| to - from).collect();
        assert_eq!(lengths, [15.0, 25.0, 30.0]);
        assert_eq!([course.lanes[1].0 - 15.0, course.lanes[2].0 - 70.0], [30.0, 25.0]);
        let widths: Vec<f64> = course.edges.iter().map(|(right, left)| left - right).collect();
        for (width, want) in widths.iter().zip([2.23, 2.41, 2.59]) {
            assert!((width - want).abs() < 1e-12, "{width} for {want}");
        }
    }

    #[test]
    fn second_course_leaves_a_gap_of_one_metre() {
        let course = Course::second(1.8);
        assert!((course.edges[1].0 - course.edges[0].1 - 1.0).abs() < 1e-12);
        assert!((course.edges[2].1 - 3.0).abs() < 1e-12);
        assert!((course.lanes[2].1 - 61.0).abs() < 1e-12);
    }

    #[test]
    fn planned_line_runs_through_the_middles() {
        let course = Course::first(1.8);
        for lane in 0..3 {
            let middle = 0.5 * (course.lanes[lane].0 + course.lanes[lane].1);
            assert!((course.line(middle)[0] - course.middle(lane)).abs() < 1e-12, "lane {lane}");
        }
    }

    #[test]
    fn a_car_on_the_planned_line_hits_no_cone() {
        let parameters = crate::Parameters::default();
        let body = crate::cones::Body::new(&parameters);
        for course in [Course::first(parameters.width), Course::second(parameters.width)] {
            let cones = course.cones();
            for i in 0..7000 {
                let x = f64::from(i) * 0.02 - 20.0;
                let [y, slope, ..] = course.line(x);
                let hit = cones.iter().find(|cone| body.covers([x, y], slope.atan(), **cone));
                assert!(hit.is_none(), "{hit:?} at {x} m");
            }
        }
    }
}
