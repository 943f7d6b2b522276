//! The road ahead of the car, by distance.
//!
//! The importer previews curvature, wanted speed and friction at the places that the reference reaches now and at the next 40
//! sample times. A car that drives slower than the reference, because grip or its drive do not allow more, reaches those
//! places later. So the preview is laid out over the distance that the reference covers, and the plan looks up curvature and
//! friction where it will be itself. The wanted speed stays a function of time: a reference that stands would never leave.

use crate::Scalar;
use crate::parameters::Parameters;
use crate::preview::PREVIEW;

/// The reference covers ground at least this fast [m/s]: a road on which it stands still has places nevertheless.
const PACE_MIN: f64 = 0.1;

/// Curvature below which no speed of a road vehicle meets the limit of grip [1/m]: 500 m/s at 1 g is 4e-5.
const STRAIGHT: f64 = 1e-5;

/// No road is more slippery than this [1]: wet ice has 0.05.
pub const FRICTION_MIN: f64 = 0.05;

/// Share of the squared grip that counts as none left [1]: far above rounding, and 3e-5 of the grip itself. On the manoeuvres
/// that grip limits (`cargo fmu simulate --road iso_3888_2 --step 0.033`, or `--set plant.speed=20`) shares are below 1e-15 or
/// above 1e-5, and with 1e-15 to 1e-6 the runs are the same to the last bit.
const ROUNDING: f64 = 1e-9;

/// Way over which the steering may smooth the curvature, as time on the reference [s]: a bend that begins all at once is steered
/// into before and after its beginning.
const STEERED_OVER: f64 = 0.3;

/// Share of the steering's rate that the path may take [1]; the rest is for coming back to it, and for the slip of the tyres.
///
/// Lane change at 14 m/s with a rate of 0.07 rad/s: 11 cm from the path, with 0.85 39, with 1 52, without the limit 29 m
/// (`cargo fmu simulate --step 0.033 --set plant.delta_rate_max=0.07 --set controller.delta_rate_max=0.07`).
const STEERED_SHARE: f64 = 0.7;

/// Speed that stands for no limit [m/s].
const NO_LIMIT: f64 = 1e3;

/// One quantity at the places of the preview.
pub type Row<T> = [T; PREVIEW];

/// The previewed road, laid out over distance.
#[derive(Clone, Copy, Debug)]
pub struct Road<T = f64> {
    /// Distance from the place of the measurement [m].
    s: Row<T>,
    /// Curvature [1/m].
    kappa: Row<T>,
    /// Wanted speed [m/s].
    v_x: Row<T>,
    /// Friction [1].
    mu: Row<T>,
    /// Speed that grip permits, with the braking that it takes to keep it [m/s].
    limit: Row<T>,
    /// Time between elements of the preview [s].
    period: f64,
}

/// Where a distance lies between the places of the preview.
#[derive(Clone, Copy, Debug)]
pub struct Place<T> {
    before: usize,
    fraction: T,
}

impl<T: Scalar> Road<T> {
    /// Lays a preview out: curvature [1/m], wanted speed [m/s] and friction, 0 where that is unknown [1].
    #[inline(always)]
    pub fn new([kappa, v_x, mu]: [Row<T>; 3], p: &Parameters) -> Self {
        let mut s = [T::zero(); PREVIEW];
        for i in 1..PREVIEW {
            s[i] = s[i - 1] + ((v_x[i - 1] + v_x[i]) * 0.5).larger(PACE_MIN) * p.t_s;
        }
        let unknown = T::from(p.mu.max(FRICTION_MIN));
        // Infinite friction is no friction that is known either; between two such places it would be no number.
        let is_known = |mu: f64| mu > 0.0 && mu.is_finite();
        let mu = mu.map(|mu| if is_known(mu.re()) { mu.larger(FRICTION_MIN) } else { unknown });
        let limit = permitted(&s, &kappa, &v_x, &mu, p);
        Self { s, kappa, v_x, mu, limit, period: p.t_s }
    }

    /// Finds a distance [m], looking from the place found `last` on: a plan goes forward.
    #[inline(always)]
    pub fn find(&self, s: T, last: usize) -> Place<T> {
        let mut before = last;
        // A distance that is no number lies nowhere, and what is found there is no number either.
        while before < PREVIEW - 2 && self.s[before + 1].re() <= s.re() {
            before += 1;
        }
        let fraction = (s - self.s[before]) / (self.s[before + 1] - self.s[before]);
        let fraction = if fraction.re() > 1.0 { T::one() } else { fraction.larger(0.0) };
        Place { before, fraction }
    }

    /// Curvature at a distance [1/m].
    pub fn curvature(&self, s: T) -> T {
        self.find(s, 0).of(&self.kappa)
    }

    /// Wanted speed after `time` [s] on the reference [m/s].
    #[inline(always)]
    pub fn wanted(&self, time: f64) -> T {
        let position = (time / self.period).clamp(0.0, (PREVIEW - 1) as f64);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the preview above")]
        let before = (position as usize).min(PREVIEW - 2);
        Place { before, fraction: T::from(position - before as f64) }.of(&self.v_x)
    }

    /// Friction at a distance [1].
    pub fn friction(&self, s: T) -> T {
        self.find(s, 0).of(&self.mu)
    }

    /// Curvature [1/m] and friction [1] at a place, and the speed that grip permits there [m/s].
    #[inline(always)]
    pub fn at(&self, place: &Place<T>) -> (T, T, T) {
        (place.of(&self.kappa), place.of(&self.mu), place.of(&self.limit))
    }
}

impl<T: Scalar> Place<T> {
    /// Index of the element before the place.
    pub fn before(&self) -> usize {
        self.before
    }

    #[inline(always)]
    fn of(&self, row: &Row<T>) -> T {
        row[self.before] + self.fraction * (row[self.before + 1] - row[self.before])
    }
}

/// Largest speed at each place at which the car gets round the bend [m/s].
///
/// In a curve the lateral acceleration takes its share of the grip, before a curve the braking; where both are needed they share
/// the circle of friction. Where the curvature changes the steering has to follow at its rate. Passed from the end of the
/// preview to its beginning, as for the speed profile of a racing line. Where every place could be driven at the fastest wanted
/// speed, nothing is limited, and nothing is passed.
#[inline(always)]
fn permitted<T: Scalar>(s: &Row<T>, kappa: &Row<T>, v_x: &Row<T>, mu: &Row<T>, p: &Parameters) -> Row<T> {
    let mut limit = [T::from(NO_LIMIT); PREVIEW];
    // A comparison is one instruction, unlike `max`, and these chains are long.
    let fastest = v_x.iter().fold(0.0, |fastest: f64, v_x| if v_x.re() > fastest { v_x.re() } else { fastest });
    let grip = |i: usize| mu[i] * (p.grip_max * p.g);
    let has_grip = |i: usize| kappa[i].re().abs() * fastest * fastest <= grip(i).re();
    let turn = Turn::new(s, kappa, p);
    // Written without branches: mostly all are easy.
    let is_easy = (0..PREVIEW).fold(true, |easy, i| easy & has_grip(i));
    if p.grip_max == 0.0 || is_easy & turn.is_followed_at(fastest) {
        return limit;
    }
    for i in (0..PREVIEW).rev() {
        let grip = grip(i);
        let curvature = if kappa[i].re() < 0.0 { -kappa[i] } else { kappa[i] };
        if curvature.re() > STRAIGHT {
            limit[i] = (grip / curvature).sqrt();
        }
        let followed = turn.fastest(i);
        if followed.re() < limit[i].re() {
            limit[i] = followed;
        }
        if i + 1 == PREVIEW {
            continue;
        }
        let lateral = limit[i + 1] * limit[i + 1] * kappa[i + 1];
        let left = grip * grip - lateral * lateral;
        // At the entry of a limiting curve nothing but rounding is left, whose root has no meaningful derivative.
        let braking = if left.re() > ROUNDING * (grip * grip).re() { left.sqrt() } else { T::zero() };
        let braking = if braking.re() > -p.a_x_min { T::from(-p.a_x_min) } else { braking };
        let before = (limit[i + 1] * limit[i + 1] + (s[i + 1] - s[i]) * braking * 2.0).sqrt();
        if before.re() < limit[i].re() {
            limit[i] = before;
        }
    }
    limit
}

/// How fast the steering has to turn where the curvature changes.
struct Turn<'a, T> {
    s: &'a Row<T>,
    kappa: &'a Row<T>,
    /// Elements from the middle of a change to its ends.
    half: usize,
    /// Wheelbase [m], and rate that the steering may be asked for [rad/s].
    wheelbase: f64,
    rate: f64,
}

impl<'a, T: Scalar> Turn<'a, T> {
    #[inline(always)]
    fn new(s: &'a Row<T>, kappa: &'a Row<T>, p: &Parameters) -> Self {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a hundred at most, periods being positive"
        )]
        let half = ((0.5 * STEERED_OVER / p.t_s).round() as usize).clamp(1, PREVIEW / 2 - 1);
        Self { s, kappa, half, wheelbase: p.l_f + p.l_r, rate: STEERED_SHARE * p.delta_rate_max }
    }

    /// Whether the steering follows all changes of the curvature at a speed [m/s].
    #[inline(always)]
    fn is_followed_at(&self, v_x: f64) -> bool {
        let over = 2 * self.half;
        let bends =
            self.kappa[over..].iter().zip(self.kappa).map(|(to, from)| (*to - *from).re().abs() * self.wheelbase);
        let ways = self.s[over..].iter().zip(self.s).map(|(to, from)| (*to - *from).re() * self.rate);
        bends.zip(ways).all(|(bend, way)| bend * v_x <= way)
    }

    /// Speed at which the steering follows the curvature around an element, or around the nearest one of [`Self::changes`] [m/s].
    fn fastest(&self, i: usize) -> T {
        let i = i.clamp(self.half, PREVIEW - 1 - self.half);
        let change = |row: &Row<T>| row[i + self.half] - row[i - self.half];
        let (bend, way) = (change(self.kappa) * self.wheelbase, change(self.s) * self.rate);
        let bend = if bend.re() < 0.0 { -bend } else { bend };
        if bend.re() * NO_LIMIT > way.re() { way / bend } else { T::from(NO_LIMIT) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A preview by its elements.
    fn rows(element: impl Fn(usize) -> [f64; 3]) -> [Row<f64>; 3] {
        std::array::from_fn(|k| std::array::from_fn(|i| element(i)[k]))
    }

    /// Straight, then a curve of 1/50 m from element 20 on, at a constant 20 m/s.
    fn curve(i: usize) -> [f64; 3] {
        [if i < 20 { 0.0 } else { 0.02 }, 20.0, 0.0]
    }

    #[test]
    fn places_are_where_the_reference_is() {
        let p = Parameters::default();
        let road = Road::new(rows(|i| [1e-4 * i as f64, 10.0 + 0.1 * i as f64, 0.0]), &p);
        // Trapezoidal sum of a linear speed, in closed form: t (10 + 0.05 t / t_s) at t = 7 periods.
        let distance = p.t_s * (70.0 + 0.05 * 49.0);
        assert!((road.curvature(distance) - 7e-4).abs() < 1e-15);
        assert!((road.wanted(7.0 * p.t_s) - 10.7).abs() < 1e-12);
        assert_eq!(road.curvature(-1.0), 0.0, "before the beginning the first element holds");
        assert_eq!(road.curvature(1e9), 40e-4, "beyond the end the last one does");
        assert!(road.curvature(f64::NAN).is_nan());
    }

    #[test]
    fn speed_before_a_curve_is_what_full_braking_leaves() {
        let p = Parameters { a_x_min: -100.0, ..Parameters::default() };
        let road = Road::new(rows(curve), &p);
        let grip = p.grip_max * p.mu * p.g;
        let in_curve = (grip / 0.02).sqrt();
        let step = 20.0 * p.t_s;
        assert!((road.at(&road.find(30.0 * step, 0)).2 - in_curve).abs() < 1e-12);
        // At the curve's first element all grip is lateral, so braking ends one element before it.
        let (_, _, limit) = road.at(&road.find(9.0 * step, 0));
        let expected = (in_curve * in_curve + 2.0 * grip * 10.0 * step).sqrt();
        assert!((limit - expected).abs() < 1e-9, "{limit} for {expected}");
        let weak = Road::new(rows(curve), &Parameters { a_x_min: -2.0, ..p.clone() });
        assert!(weak.at(&weak.find(9.0 * step, 0)).2 < limit, "weak brakes need more room");
        let off = Road::new(rows(curve), &Parameters { grip_max: 0.0, ..p });
        assert_eq!(off.at(&off.find(30.0 * step, 0)).2, NO_LIMIT);
    }

    #[test]
    fn where_the_curvature_changes_the_steering_has_time() {
        // A bend that tightens by 0.002 1/m a metre from 5 m on; the preview ends at 26 m.
        let kappa = |s: f64| 0.002 * (s - 5.0).max(0.0);
        let p = Parameters { delta_rate_max: 0.05, ..Parameters::default() };
        let wanted = 20.0;
        let preview = |i: usize| [kappa(i as f64 * wanted * p.t_s), wanted, 0.0];
        let road = Road::new(rows(preview), &p);
        let limit = |s: f64| road.at(&road.find(s, 0)).2;
        let followed = STEERED_SHARE * p.delta_rate_max / ((p.l_f + p.l_r) * 0.002);
        for s in [15.0, 26.0] {
            assert!((limit(s) - followed).abs() < 1e-9, "{s} m: {} for {followed}", limit(s));
        }
        assert!(limit(0.0) > followed + 1.0, "there is time to brake: {}", limit(0.0));
        for quick in [Parameters { delta_rate_max: 5.0, ..p.clone() }, Parameters { grip_max: 0.0, ..p.clone() }] {
            let road = Road::new(rows(|i| [0.1 * preview(i)[0], wanted, 0.0]), &quick);
            assert_eq!(road.at(&road.find(10.0, 0)).2, NO_LIMIT);
        }
    }

    #[test]
    fn friction_of_the_preview_counts_and_the_parameter_where_there_is_none() {
        let p = Parameters::default();
        let road = Road::new(rows(|i| [0.02, 20.0, if i < 20 { 0.0 } else { 0.4 }]), &p);
        let step = 20.0 * p.t_s;
        assert_eq!(road.friction(5.0 * step), p.mu);
        assert_eq!(road.friction(30.0 * step), 0.4);
        let (_, _, limit) = road.at(&road.find(30.0 * step, 0));
        assert!((limit - (p.grip_max * 0.4 * p.g / 0.02).sqrt()).abs() < 1e-12);
        let endless = Road::new(rows(|i| [0.02, 20.0, if i < 20 { f64::INFINITY } else { 0.4 }]), &p);
        assert_eq!(endless.friction(5.5 * step), p.mu);
    }
}
