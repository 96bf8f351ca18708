//! From arbiters to wide rows, and back.
//!
//! Records of contacts and bodies are transposed into lanes ([`Instructions::load`]), then all lanes compute together.
//! With `q₁, q₂` the rotations and `c₁, c₂` the centres of mass, a point has the gap `n · ((c₂ + q₂ anchor₂) − (c₁ + q₁
//! anchor₁))`, levers `rₖ` (the anchors as they were turned when the manifold was made), and the response between
//! points `i` and `j`
//!
//! ```text
//! Aᵢⱼ = n·(M₁⁻¹ + M₂⁻¹)n + (r₁ⱼ×n)·I₁⁻¹(r₁ᵢ×n) + (r₂ⱼ×n)·I₂⁻¹(r₂ᵢ×n)
//! ```
//!
//! whose diagonal is the inverse effective mass. Velocity parts that a contact leaves alone have their inverse mass or
//! inertia set to zero, so they neither move nor count.

use super::bodies::{BodyMass, READ_ONLY, SharedStates, SolverBodies, gather};
use super::coloring::RowSource;
use super::rows::{ExtraRow, FrictionRow, NormalRow, RowFeatures};
use crate::arbiter::{ANISOTROPIC, Arbiter, Contact, ONE_NORMAL, SLOTS, SolveMode};
use crate::math::{Real, Vec3};
use crate::simd::{LaneRotation, LaneSymmetric, LaneVec3, Lanes, Number, Quad};

/// What preparing and storing read.
#[derive(Clone, Copy)]
pub(crate) struct PrepareContext<'a> {
    pub arbiters: &'a [Arbiter],
    pub bodies: &'a SolverBodies,
    pub speculative_distance: Real,
}

/// Where one wide row goes.
pub(crate) struct RowTarget<'a, W, const L: usize, const P: usize, const C: usize> {
    pub row: &'a mut NormalRow<W, L, P, C>,
    pub friction: &'a mut FrictionRow<W, P>,
    /// There if the arbiters or bodies ask for it: [`RowSource::extra`].
    pub extra: Option<&'a mut ExtraRow<W, P>>,
    pub features: &'a mut RowFeatures,
}

/// Where the bodies of one side stand.
struct WideFrame<W> {
    center: LaneVec3<W>,
    rotation: LaneRotation<W>,
}

/// Anchors and impulses of a wide row while it is prepared.
struct Gathered<W, const P: usize> {
    r1: [LaneVec3<W>; P],
    r2: [LaneVec3<W>; P],
    /// From anchor 1 to anchor 2, as the bodies stand now.
    apart: [LaneVec3<W>; P],
    /// 1 where the lane has the point, else 0.
    present: [W; P],
    /// Sum of the points' friction impulses of the last step.
    tangential: LaneVec3<W>,
    twist: W,
    /// Inverse mass of both bodies together along each world axis.
    response: LaneVec3<W>,
}

/// The contact of an empty lane.
static NO_CONTACT: Contact = Contact {
    local_anchor1: Vec3::ZERO,
    local_anchor2: Vec3::ZERO,
    normal: Vec3::ZERO,
    normal_impulse: 0.0,
    tangent_impulse: Vec3::ZERO,
    twist_impulse: 0.0,
    separation: 0.0,
    total_impulse: 0.0,
    feature: 0,
    remove: SolveMode::NONE,
    world_normal: false,
};

/// The body of an empty lane.
static NO_BODY: BodyMass = BodyMass::NONE;

/// Fills a wide row from its sources; lanes past the end of `sources` stay empty.
#[inline(always)]
pub(crate) fn prepare_row<W: Lanes<L>, const L: usize, const P: usize, const C: usize>(
    target: RowTarget<'_, W, L, P, C>,
    sources: &[RowSource],
    context: &PrepareContext<'_>,
) {
    let RowTarget { row, friction, mut extra, features } = target;
    // Without an extra row the plan has found that none is needed.
    let asked = extra.is_some() || cfg!(debug_assertions);
    *features = if asked { features_of(sources, context) } else { RowFeatures::default() };
    let mut gathered = gather_bodies((row, extra.as_deref_mut(), features), sources, context);
    let (frame1, frame2) = (gathered.1, gathered.2);
    gather_points(row, &mut gathered.0, (&frame1, &frame2), (sources, context));
    let gathered = gathered.0;
    let separations = prepare_normals(row, &gathered);
    friction.tangent1 = wide_tangent(&row.normal);
    if let Some(extra) = extra.as_deref_mut().filter(|_| features.anisotropic) {
        align_tangents(row, friction, extra, sources, context);
    }
    prepare_friction(row, friction, &gathered, &separations, context.speculative_distance);
    if let Some(extra) = extra.as_deref().filter(|_| features.anisotropic) {
        align_levers(row, friction, &extra.ratio, &gathered);
    }
    let mut coefficients = [0.0; L];
    for (lane, source) in sources.iter().enumerate().take(L) {
        let data = &context.arbiters[source.arbiter as usize].data;
        coefficients[lane] = if data.is_other(source.slots) { data.other_friction } else { data.friction };
    }
    friction.friction = W::from_array(coefficients);
    if let Some(extra) = extra.filter(|_| features.any()) {
        prepare_extra(row, friction, (extra, *features), sources, context);
    }
}

/// What the arbiters ask for; locks are found with the bodies.
#[inline(always)]
fn features_of(sources: &[RowSource], context: &PrepareContext<'_>) -> RowFeatures {
    let mut features = RowFeatures::default();
    for source in sources {
        let data = &context.arbiters[source.arbiter as usize].data;
        features.restitution |= data.restitution > 0.0 || data.other_slots != 0 && data.other_restitution > 0.0;
        features.rolling |= data.rolling_resistance > 0.0;
        features.conveyor |= data.tangent_velocity != Vec3::ZERO;
        features.anisotropic |= data.flags & ANISOTROPIC != 0;
    }
    features
}

/// Masses of both bodies, with the parts removed that the contact leaves alone.
#[inline(always)]
fn gather_bodies<W: Lanes<L>, const L: usize, const P: usize, const C: usize>(
    (row, extra, features): (&mut NormalRow<W, L, P, C>, Option<&mut ExtraRow<W, P>>, &mut RowFeatures),
    sources: &[RowSource],
    context: &PrepareContext<'_>,
) -> (Gathered<W, P>, WideFrame<W>, WideFrame<W>) {
    let mut records1 = [NO_BODY.quads(); L];
    let mut records2 = [NO_BODY.quads(); L];
    (row.body1, row.body2) = ([READ_ONLY; L], [READ_ONLY; L]);
    let read_only = |body: u32| if context.bodies.states[body as usize].moves != 0 { body } else { body | READ_ONLY };
    for (lane, source) in sources.iter().enumerate().take(L) {
        let arbiter = &context.arbiters[source.arbiter as usize];
        let (b1, b2) = (arbiter.body1.index, arbiter.body2.index);
        records1[lane] = context.bodies.masses[b1 as usize].quads();
        records2[lane] = context.bodies.masses[b2 as usize].quads();
        (row.body1[lane], row.body2[lane]) = (read_only(b1), read_only(b2));
    }
    let side1 = load_mass(&records1);
    let side2 = load_mass(&records2);
    (row.inverse_mass1, row.inverse_inertia1) = (side1.inverse_mass, side1.inverse_inertia);
    (row.inverse_mass2, row.inverse_inertia2) = (side2.inverse_mass, side2.inverse_inertia);
    for (lane, source) in sources.iter().enumerate().take(L) {
        remove_parts(row, lane, source, context);
    }
    features.locks = side1.locked || side2.locked;
    debug_assert!(extra.is_some() || !features.any(), "the plan has missed {features:?}");
    if let Some(extra) = extra.filter(|_| features.any()) {
        *extra = ExtraRow::EMPTY;
        (extra.free1, extra.free2) = (side1.free, side2.free);
    }
    let (m1, m2) = (row.inverse_mass1, row.inverse_mass2);
    let response = LaneVec3 {
        x: m1 * side1.free.x + m2 * side2.free.x,
        y: m1 * side1.free.y + m2 * side2.free.y,
        z: m1 * side1.free.z + m2 * side2.free.z,
    };
    let gathered = Gathered {
        r1: [LaneVec3::ZERO; P],
        r2: [LaneVec3::ZERO; P],
        apart: [LaneVec3::ZERO; P],
        present: [W::ZERO; P],
        tangential: LaneVec3::ZERO,
        twist: W::ZERO,
        response,
    };
    (gathered, side1.frame, side2.frame)
}

/// The bodies of one side.
struct WideMass<W> {
    frame: WideFrame<W>,
    inverse_mass: W,
    inverse_inertia: LaneSymmetric<W>,
    /// 1 along free axes, 0 along locked ones.
    free: LaneVec3<W>,
    /// Whether some body has a locked axis.
    locked: bool,
}

#[inline(always)]
fn load_mass<W: Lanes<L>, const L: usize>(records: &[&[Quad; 4]; L]) -> WideMass<W> {
    let [cx, cy, cz, qx] = W::load_quad(records, 0);
    let [qy, qz, qw, mx] = W::load_quad(records, 1);
    let [my, mz, xx, yy] = W::load_quad(records, 2);
    let [zz, xy, xz, yz] = W::load_quad(records, 3);
    let inverse_mass = mx.max(my).max(mz);
    // A body that does not move at all is free: its inverse mass is zero anyway.
    let (locked, one) = (W::ZERO, W::splat(1.0));
    let free = LaneVec3 {
        x: (inverse_mass - mx).if_positive(locked, one),
        y: (inverse_mass - my).if_positive(locked, one),
        z: (inverse_mass - mz).if_positive(locked, one),
    };
    WideMass {
        frame: WideFrame {
            center: LaneVec3 { x: cx, y: cy, z: cz },
            rotation: LaneRotation { vector: LaneVec3 { x: qx, y: qy, z: qz }, w: qw },
        },
        inverse_mass,
        inverse_inertia: LaneSymmetric { xx, yy, zz, xy, xz, yz },
        locked: (free.x * free.y * free.z).to_array().contains(&0.0),
        free,
    }
}

/// Zeroes the masses and inertias that a contact is not to change.
#[inline(always)]
fn remove_parts<W: Lanes<L>, const L: usize, const P: usize, const C: usize>(
    row: &mut NormalRow<W, L, P, C>,
    lane: usize,
    source: &RowSource,
    context: &PrepareContext<'_>,
) {
    let data = &context.arbiters[source.arbiter as usize].data;
    let mode = data.solve_mode & !data.slots[source.slots.trailing_zeros() as usize].remove;
    if mode == SolveMode::FULL {
        return;
    }
    if !mode.contains(SolveMode::LINEAR_BODY1) {
        row.inverse_mass1.set(lane, 0.0);
    }
    if !mode.contains(SolveMode::LINEAR_BODY2) {
        row.inverse_mass2.set(lane, 0.0);
    }
    if !mode.contains(SolveMode::ANGULAR_BODY1) {
        row.inverse_inertia1.clear(lane);
    }
    if !mode.contains(SolveMode::ANGULAR_BODY2) {
        row.inverse_inertia2.clear(lane);
    }
}

/// Anchors, levers, normals and impulses.
#[inline(always)]
fn gather_points<W: Lanes<L>, const L: usize, const P: usize, const C: usize>(
    row: &mut NormalRow<W, L, P, C>,
    gathered: &mut Gathered<W, P>,
    (frame1, frame2): (&WideFrame<W>, &WideFrame<W>),
    (sources, context): (&[RowSource], &PrepareContext<'_>),
) {
    let mut contacts = [[&NO_CONTACT; L]; P];
    let mut rotations = [&[[0.0; 4]; 2]; L];
    let mut present = [[0.0; L]; P];
    let mut fresh = false;
    for (lane, source) in sources.iter().enumerate().take(L) {
        let data = &context.arbiters[source.arbiter as usize].data;
        fresh |= data.flags & ONE_NORMAL == 0;
        rotations[lane] = data.rotation_quads();
        let mut slots = source.slots;
        for point in 0..P {
            if slots != 0 {
                contacts[point][lane] = &data.slots[slots.trailing_zeros() as usize % SLOTS];
                present[point][lane] = 1.0;
                slots &= slots - 1;
            }
        }
    }
    let between = frame2.center - frame1.center;
    let (then1, then2) = (load_rotation(&rotations, 0), load_rotation(&rotations, 1));
    for point in 0..P {
        gathered.present[point] = W::from_array(present[point]);
        let mut records = [&[[0.0; 4]; 4]; L];
        for lane in 0..L {
            records[lane] = contacts[point][lane].quads();
        }
        let [x1, y1, z1, x2] = W::load_quad(&records, 0);
        let [y2, z2, nx, ny] = W::load_quad(&records, 1);
        let [nz, impulse, tx, ty] = W::load_quad(&records, 2);
        let [tz, twist, _, _] = W::load_quad(&records, 3);
        let (anchor1, anchor2) = (LaneVec3 { x: x1, y: y1, z: z1 }, LaneVec3 { x: x2, y: y2, z: z2 });
        let (turned1, turned2) = (frame1.rotation.rotate(&anchor1), frame2.rotation.rotate(&anchor2));
        gathered.apart[point] = between + (turned2 - turned1);
        gathered.r1[point] = then1.rotate(&anchor1);
        gathered.r2[point] = then2.rotate(&anchor2);
        if fresh {
            for (lane, contact) in contacts[point].iter().enumerate() {
                if contact.world_normal {
                    gathered.r1[point].set(lane, turned1.get(lane));
                    gathered.r2[point].set(lane, turned2.get(lane));
                }
            }
        }
        if point == 0 {
            row.normal = LaneVec3 { x: nx, y: ny, z: nz };
        }
        row.impulses[point] = impulse;
        gathered.tangential = gathered.tangential + LaneVec3 { x: tx, y: ty, z: tz };
        gathered.twist += twist;
    }
}

#[inline(always)]
fn load_rotation<W: Lanes<L>, const L: usize>(records: &[&[Quad; 2]; L], side: usize) -> LaneRotation<W> {
    let [x, y, z, w] = W::load_quad(records, side);
    LaneRotation { vector: LaneVec3 { x, y, z }, w }
}

/// `a · M⁻¹ b`: the response along `a` to a linear impulse along `b`.
#[inline(always)]
fn linear_response<W: Number, const P: usize>(gathered: &Gathered<W, P>, a: &LaneVec3<W>, b: &LaneVec3<W>) -> W {
    let m = &gathered.response;
    m.x * (a.x * b.x) + m.y * (a.y * b.y) + m.z * (a.z * b.z)
}

/// Arms, gaps, effective masses and couplings of the points; returns the gaps, with empty points far apart.
#[inline(always)]
fn prepare_normals<W: Lanes<L>, const L: usize, const P: usize, const C: usize>(
    row: &mut NormalRow<W, L, P, C>,
    gathered: &Gathered<W, P>,
) -> [W; P] {
    let n = row.normal;
    let linear = linear_response(gathered, &n, &n);
    let (mut between, mut count) = (LaneVec3::ZERO, W::ZERO);
    for i in 0..P {
        between = between.add_scaled(&(gathered.r2[i] - gathered.r1[i]), gathered.present[i]);
        count += gathered.present[i];
    }
    row.offset = between.scale(count.inverse_or_zero()).cross(&n);
    let mut turned1 = [LaneVec3::ZERO; P];
    let mut turned2 = [LaneVec3::ZERO; P];
    let mut separations = [W::ZERO; P];
    for i in 0..P {
        let arm1 = gathered.r1[i].cross(&n);
        let arm2 = arm1 + row.offset;
        let gap = gathered.apart[i].dot(&n);
        turned1[i] = row.inverse_inertia1.mul(&arm1);
        turned2[i] = row.inverse_inertia2.mul(&arm2);
        let response = linear + arm1.dot(&turned1[i]) + arm2.dot(&turned2[i]);
        separations[i] = gathered.present[i].if_positive(gap, W::splat(1e3));
        let point = &mut row.points[i];
        (point.arm, point.separation) = (arm1, separations[i]);
        point.mass = gathered.present[i].if_positive(response.inverse_or_zero(), W::ZERO);
    }
    let mut pair = 0;
    for i in 0..P {
        for j in i + 1..P {
            let arm = &row.points[j].arm;
            row.coupling[pair] = linear + arm.dot(&turned1[i]) + (*arm + row.offset).dot(&turned2[i]);
            pair += 1;
        }
    }
    separations
}

/// Friction centre, the response of the tangents, and the impulses of the last step turned into these tangents.
///
/// The centre is the mean of the points, where points that are apart fade out between one and two speculative distances: a
/// point that only might touch must not shift the friction.
#[inline(always)]
fn prepare_friction<W: Lanes<L>, const L: usize, const P: usize, const C: usize>(
    row: &NormalRow<W, L, P, C>,
    friction: &mut FrictionRow<W, P>,
    gathered: &Gathered<W, P>,
    separations: &[W; P],
    speculative_distance: Real,
) {
    let (mut r1, mut r2, mut total) = (LaneVec3::ZERO, LaneVec3::ZERO, W::ZERO);
    let (two, one) = (W::splat(2.0), W::splat(1.0));
    let fade = W::splat(1.0 / crate::math::max(speculative_distance, 1e-12));
    for (i, &separation) in separations.iter().enumerate() {
        let weight = (two - separation * fade).min(one).max(W::splat(1e-6)) * gathered.present[i];
        r1 = r1.add_scaled(&gathered.r1[i], weight);
        r2 = r2.add_scaled(&gathered.r2[i], weight);
        total += weight;
    }
    let inverse = total.inverse_or_zero();
    let (r1, r2) = (r1.scale(inverse), r2.scale(inverse));
    friction.drift = W::ZERO;
    for (i, &separation) in separations.iter().enumerate() {
        let away = gathered.r1[i] - r1;
        friction.levers[i] = away.dot(&away).sqrt() * gathered.present[i];
        let sideways = gathered.apart[i].sub_scaled(&row.normal, separation);
        friction.drift = friction.drift.max((sideways.dot(&sideways) * gathered.present[i]).sqrt());
    }
    let t1 = friction.tangent1;
    let t2 = row.normal.cross(&t1);
    (friction.lever1, friction.lever2) = (r1, r2);
    let (arm11, arm21, arm12, arm22) = (r1.cross(&t1), r2.cross(&t1), r1.cross(&t2), r2.cross(&t2));
    let turned11 = row.inverse_inertia1.mul(&arm11);
    let turned21 = row.inverse_inertia2.mul(&arm21);
    let turned12 = row.inverse_inertia1.mul(&arm12);
    let turned22 = row.inverse_inertia2.mul(&arm22);
    let k11 = linear_response(gathered, &t1, &t1) + arm11.dot(&turned11) + arm21.dot(&turned21);
    let k12 = linear_response(gathered, &t1, &t2) + arm12.dot(&turned11) + arm22.dot(&turned21);
    let k22 = linear_response(gathered, &t2, &t2) + arm12.dot(&turned12) + arm22.dot(&turned22);
    let inverse = (k11 * k22 - k12 * k12).inverse_or_zero();
    friction.mass11 = k22 * inverse;
    friction.mass12 = -(k12 * inverse);
    friction.mass22 = k11 * inverse;
    let twist = row.inverse_inertia1.add(&row.inverse_inertia2).mul(&row.normal).dot(&row.normal);
    friction.twist_mass = twist.inverse_or_zero();
    friction.impulse1 = gathered.tangential.dot(&t1);
    friction.impulse2 = gathered.tangential.dot(&t2);
    // One point has no lever and solves no twist: what an arbiter of more points has left of it must not act on.
    friction.twist_impulse = if P == 1 { W::ZERO } else { gathered.twist };
    friction.totals = [W::ZERO; P];
}

/// The first of [`crate::math::tangents`] in lanes.
#[inline(always)]
fn wide_tangent<W: Number>(n: &LaneVec3<W>) -> LaneVec3<W> {
    let (one, down) = (W::splat(1.0), W::splat(-1.0));
    let sign = (-n.z).if_positive(down, one);
    let a = -(one / (sign + n.z));
    LaneVec3 { x: one + sign * n.x * n.x * a, y: sign * (n.x * n.y * a), z: -(sign * n.x) }
}

/// Turns the first tangent of anisotropic lanes to the direction along which friction differs. Where that stands
/// straight up, friction is the same in all directions.
#[inline(always)]
fn align_tangents<W: Lanes<L>, const L: usize, const P: usize, const C: usize>(
    row: &NormalRow<W, L, P, C>,
    friction: &mut FrictionRow<W, P>,
    extra: &mut ExtraRow<W, P>,
    sources: &[RowSource],
    context: &PrepareContext<'_>,
) {
    for (lane, source) in sources.iter().enumerate().take(L) {
        let data = &context.arbiters[source.arbiter as usize].data;
        if data.flags & ANISOTROPIC != 0 {
            let normal = row.normal.get(lane);
            let along = data.friction_direction - normal * normal.dot(data.friction_direction);
            let length = along.length();
            if length > LEAST_PART_ALONG {
                friction.tangent1.set(lane, along / length);
                extra.ratio.set(lane, data.friction_ratio);
            }
        }
    }
}

/// Levers of the twist of anisotropic lanes: a point at `(a, b)` from the friction centre, `a` along the direction in which
/// friction is `ratio` times that across, slides along `(−b, a)` when the bodies twist, where the ellipse of friction gives
/// way at `μ √((ratio b)² + a²) / √(a² + b²)`.
#[inline(always)]
fn align_levers<W: Lanes<L>, const L: usize, const P: usize, const C: usize>(
    row: &NormalRow<W, L, P, C>,
    friction: &mut FrictionRow<W, P>,
    ratio: &W,
    gathered: &Gathered<W, P>,
) {
    let t1 = friction.tangent1;
    let t2 = row.normal.cross(&t1);
    for i in 0..P {
        let away = gathered.r1[i] - friction.lever1;
        let (a, b) = (away.dot(&t1), *ratio * away.dot(&t2));
        let lever = (a * a + b * b).sqrt() * gathered.present[i];
        friction.levers[i] = ratio.if_positive(lever, friction.levers[i]);
    }
}

/// Part along the surface that a direction of friction has to have: less than 0.6° off the normal it tells nothing.
const LEAST_PART_ALONG: Real = 0.01;

/// Rolling resistance, surface velocities and restitution.
#[inline(always)]
fn prepare_extra<W: Lanes<L>, const L: usize, const P: usize, const C: usize>(
    row: &NormalRow<W, L, P, C>,
    friction: &FrictionRow<W, P>,
    (extra, features): (&mut ExtraRow<W, P>, RowFeatures),
    sources: &[RowSource],
    context: &PrepareContext<'_>,
) {
    let t1 = friction.tangent1;
    let t2 = row.normal.cross(&t1);
    for (lane, source) in sources.iter().enumerate().take(L) {
        let data = &context.arbiters[source.arbiter as usize].data;
        let other = data.is_other(source.slots);
        extra.restitution.set(lane, if other { data.other_restitution } else { data.restitution });
        extra.target1.set(lane, data.tangent_velocity.dot(t1.get(lane)));
        extra.target2.set(lane, data.tangent_velocity.dot(t2.get(lane)));
        // Each row resists under its own load; what is carried over from step to step starts in the first.
        extra.rolling_resistance.set(lane, data.rolling_resistance);
        if source.is_first() {
            extra.rolling_impulse.set(lane, data.rolling_impulse);
        }
    }
    if features.restitution {
        prepare_restitution(row, extra, context.bodies);
    }
}

/// Normal velocities with which the points would hit.
///
/// A point that is a gap `s` away at relative speed `u₀` and acceleration `a` along the normal hits at
/// `u² = u₀² − 2as`: without this, what is missing of a step's gravity would cost a bounce a few percent of its height.
#[inline(always)]
fn prepare_restitution<W: Lanes<L>, const L: usize, const P: usize, const C: usize>(
    row: &NormalRow<W, L, P, C>,
    extra: &mut ExtraRow<W, P>,
    bodies: &SolverBodies,
) {
    for lane in 0..L {
        let (b1, b2) = ((row.body1[lane] & !READ_ONLY) as usize, (row.body2[lane] & !READ_ONLY) as usize);
        let (s1, s2) = (&bodies.states[b1], &bodies.states[b2]);
        let n = row.normal.get(lane);
        let linear = n.dot(s2.linear_velocity - s1.linear_velocity) + row.offset.get(lane).dot(s2.angular_velocity);
        let spin = s2.angular_velocity - s1.angular_velocity;
        let acceleration = n.dot(bodies.motions[b2].acceleration - bodies.motions[b1].acceleration);
        for i in 0..P {
            let point = &row.points[i];
            let speed = linear + point.arm.get(lane).dot(spin);
            let squared = speed * speed - 2.0 * acceleration * point.separation.get(lane);
            let hit = if speed < 0.0 && squared > 0.0 { -squared.sqrt() } else { crate::math::min(speed, 0.0) };
            extra.approach[i].set(lane, hit);
        }
    }
}

/// A solved wide row.
pub(crate) struct SolvedRow<'a, W, const L: usize, const P: usize, const C: usize> {
    pub row: &'a NormalRow<W, L, P, C>,
    pub friction: &'a FrictionRow<W, P>,
    pub extra: Option<&'a ExtraRow<W, P>>,
    pub features: RowFeatures,
}

/// What goes back to the contacts of a wide row.
pub(crate) struct Outcome<const L: usize, const P: usize> {
    /// The last two groups of numbers of each point's [`Contact::quads`], by lane.
    thirds: [[Quad; L]; P],
    fourths: [[Quad; L]; P],
    /// How far past the break distance some contact may be: zero or less if all are within it. Else ask
    /// [`crate::arbiter::ContactData::break_contacts`].
    pub excess: [f32; L],
}

/// Reads off what a wide row has come to.
///
/// # Safety
/// No thread may write body states meanwhile.
#[inline(always)]
pub(crate) unsafe fn read_row<W: Lanes<L>, const L: usize, const P: usize, const C: usize>(
    solved: &SolvedRow<'_, W, L, P, C>,
    states: &SharedStates<'_>,
    break_distance: Real,
) -> Outcome<L, P> {
    let (row, friction) = (solved.row, solved.friction);
    // SAFETY: promised by the caller.
    let ((_, d1), (_, d2)) = unsafe { (gather(states, &row.body1), gather(states, &row.body2)) };
    let n = row.normal;
    let (t1, t2) = (friction.tangent1, n.cross(&friction.tangent1));
    let tangential = t1.scale(friction.impulse1).add_scaled(&t2, friction.impulse2);
    let mut load = W::ZERO;
    for &impulse in &row.impulses {
        load += impulse;
    }
    let moved = d2.translation - d1.translation;
    let turned = d2.turn - d1.turn;
    let approach = n.dot(&moved) + row.offset.dot(&d2.turn);
    let (mut reach, mut widest) = (W::ZERO, W::splat(-Real::MAX));
    let mut outcome = Outcome { thirds: [[[0.0; 4]; L]; P], fourths: [[[0.0; 4]; L]; P], excess: [0.0; L] };
    for i in 0..P {
        let impulse = row.impulses[i];
        // A quotient of the two: 1 / load is infinite for loads that are hardly numbers any more.
        let share = load.if_positive(impulse / load, W::ZERO);
        let part = tangential.scale(share);
        let point = &row.points[i];
        let gap = point.separation + approach + point.arm.dot(&turned);
        outcome.thirds[i] = W::store(&[n.z, impulse, part.x, part.y]);
        outcome.fourths[i] = W::store(&[part.z, friction.twist_impulse * share, gap, friction.totals[i]]);
        // Points that a lane lacks are a kilometre apart.
        widest = (W::splat(900.0) - point.separation).if_positive(widest.max(gap), widest);
        reach = reach.max(friction.levers[i]);
    }
    let slide = moved + d2.turn.cross(&friction.lever2) - d1.turn.cross(&friction.lever1);
    let sideways = slide.sub_scaled(&n, n.dot(&slide));
    // First order may be off by a tenth for the turns of one step; the exact test decides.
    let swept = sideways.dot(&sideways).sqrt() + turned.dot(&turned).sqrt() * reach;
    let drift = friction.drift + W::splat(1.1) * swept;
    outcome.excess = (drift - W::splat(break_distance)).max(widest - W::splat(0.9 * break_distance)).to_array();
    outcome
}

/// Writes impulses and gaps of one lane to its arbiter.
///
/// # Safety
/// No other thread may touch the slots of this row in the arbiter, nor, if the row is the first, its rolling impulse.
#[inline(always)]
pub(crate) unsafe fn store_lane<W: Lanes<L>, const L: usize, const P: usize, const C: usize>(
    outcome: &Outcome<L, P>,
    solved: &SolvedRow<'_, W, L, P, C>,
    lane: usize,
    source: &RowSource,
    arbiter: *mut Arbiter,
) {
    let mut slots = source.slots;
    for point in 0..P {
        if slots == 0 {
            break;
        }
        // SAFETY: promised by the caller.
        let contact = unsafe { &mut (*arbiter).data.slots[slots.trailing_zeros() as usize % SLOTS] };
        let quads = contact.quads_mut();
        (quads[2], quads[3]) = (outcome.thirds[point][lane], outcome.fourths[point][lane]);
        slots &= slots - 1;
    }
    if let (true, Some(extra)) = (source.is_first() && solved.features.rolling, solved.extra) {
        // SAFETY: promised by the caller.
        unsafe { (*arbiter).data.rolling_impulse = extra.rolling_impulse.get(lane) };
    }
}
