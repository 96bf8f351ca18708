//! From arbiters to wide rows, and back.
//!
//! Each lane's numbers are gathered from its arbiter, then all lanes compute together. With `q₁, q₂` the rotations and
//! `c₁, c₂` the centres of mass, a point has the gap `n · ((c₂ + q₂ anchor₂) − (c₁ + q₁ anchor₁))`, levers `rₖ` (the anchors
//! as they were turned when the manifold was made), and the response between points `i` and `j`
//!
//! ```text
//! Aᵢⱼ = n·(M₁⁻¹ + M₂⁻¹)n + (r₁ⱼ×n)·I₁⁻¹(r₁ᵢ×n) + (r₂ⱼ×n)·I₂⁻¹(r₂ᵢ×n)
//! ```
//!
//! whose diagonal is the inverse effective mass. Velocity parts that a contact leaves alone have their inverse mass or
//! inertia set to zero, so they neither move nor count.

use super::bodies::{READ_ONLY, SolverBodies};
use super::coloring::RowSource;
use super::rows::{FrictionRow, NormalRow};
use crate::arbiter::{Arbiter, SLOTS, SolveMode};
use crate::math::{Real, Vec3};
use crate::simd::{Wide, WideSymmetric, WideVec3};

/// What preparing and storing read.
#[derive(Clone, Copy)]
pub(crate) struct PrepareContext<'a> {
    pub arbiters: &'a [Arbiter],
    pub bodies: &'a SolverBodies,
    pub speculative_distance: Real,
}

/// Poses and anchors of a wide row while it is prepared.
struct Gathered<const L: usize, const P: usize> {
    r1: [WideVec3<L>; P],
    r2: [WideVec3<L>; P],
    /// From anchor 1 to anchor 2, as the bodies stand now.
    apart: [WideVec3<L>; P],
    /// 1 where the lane has the point, else 0.
    present: [Wide<L>; P],
}

/// Fills a wide row from its sources; lanes past the end of `sources` stay empty.
#[inline(always)]
pub(crate) fn prepare_row<const L: usize, const P: usize, const C: usize>(
    row: &mut NormalRow<L, P, C>,
    friction: &mut FrictionRow<L, P>,
    sources: &[RowSource],
    context: &PrepareContext<'_>,
) {
    *row = NormalRow::EMPTY;
    *friction = FrictionRow::EMPTY;
    let mut gathered = Gathered {
        r1: [WideVec3::ZERO; P],
        r2: [WideVec3::ZERO; P],
        apart: [WideVec3::ZERO; P],
        present: [Wide::ZERO; P],
    };
    for (lane, source) in sources.iter().enumerate().take(L) {
        gather_bodies(row, lane, source, context);
        gather_points(row, friction, &mut gathered, lane, source, context);
    }
    let separations = prepare_normals(row, &gathered);
    prepare_friction(row, friction, &gathered, &separations, context.speculative_distance);
    for (lane, source) in sources.iter().enumerate().take(L) {
        warm_friction(friction, lane, source, context);
    }
    if friction.has_restitution {
        prepare_restitution(row, friction, context.bodies);
    }
}

/// Masses of both bodies, with the parts removed that the contact leaves alone.
#[inline(always)]
fn gather_bodies<const L: usize, const P: usize, const C: usize>(
    row: &mut NormalRow<L, P, C>,
    lane: usize,
    source: &RowSource,
    context: &PrepareContext<'_>,
) {
    let arbiter = &context.arbiters[source.arbiter as usize];
    let (b1, b2) = (arbiter.body1.index, arbiter.body2.index);
    let (m1, m2) = (&context.bodies.masses[b1 as usize], &context.bodies.masses[b2 as usize]);
    let lead = &arbiter.data.slots[source.slots.trailing_zeros() as usize];
    let mode = arbiter.data.solve_mode & !lead.remove;
    let read_only = |body: u32| if context.bodies.states[body as usize].moves != 0 { body } else { body | READ_ONLY };
    row.body1[lane] = read_only(b1);
    row.body2[lane] = read_only(b2);
    row.normal.set(lane, lead.normal);
    if mode.contains(SolveMode::LINEAR_BODY1) {
        row.inverse_mass1.set(lane, m1.inverse_mass);
    }
    if mode.contains(SolveMode::LINEAR_BODY2) {
        row.inverse_mass2.set(lane, m2.inverse_mass);
    }
    if mode.contains(SolveMode::ANGULAR_BODY1) {
        set_inertia(&mut row.inverse_inertia1, lane, &m1.inverse_inertia);
    }
    if mode.contains(SolveMode::ANGULAR_BODY2) {
        set_inertia(&mut row.inverse_inertia2, lane, &m2.inverse_inertia);
    }
}

#[inline(always)]
fn set_inertia<const L: usize>(wide: &mut WideSymmetric<L>, lane: usize, m: &crate::math::SymmetricMat3) {
    wide.xx[lane] = m.xx;
    wide.yy[lane] = m.yy;
    wide.zz[lane] = m.zz;
    wide.xy[lane] = m.xy;
    wide.xz[lane] = m.xz;
    wide.yz[lane] = m.yz;
}

/// Anchors, impulses and material.
#[inline(always)]
fn gather_points<const L: usize, const P: usize, const C: usize>(
    row: &mut NormalRow<L, P, C>,
    friction: &mut FrictionRow<L, P>,
    gathered: &mut Gathered<L, P>,
    lane: usize,
    source: &RowSource,
    context: &PrepareContext<'_>,
) {
    let arbiter = &context.arbiters[source.arbiter as usize];
    let data = &arbiter.data;
    let m1 = &context.bodies.masses[arbiter.body1.index as usize];
    let m2 = &context.bodies.masses[arbiter.body2.index as usize];
    let mut point = 0;
    for slot in 0..SLOTS {
        if source.slots >> slot & 1 == 1 && point < P {
            let contact = &data.slots[slot];
            let (r1, r2) = (m1.rotation.rotate(contact.local_anchor1), m2.rotation.rotate(contact.local_anchor2));
            let fresh = contact.world_normal;
            gathered.r1[point].set(lane, if fresh { r1 } else { contact.arm1 });
            gathered.r2[point].set(lane, if fresh { r2 } else { contact.arm2 });
            gathered.apart[point].set(lane, (m2.center - m1.center) + (r2 - r1));
            gathered.present[point][lane] = 1.0;
            row.impulses[point][lane] = contact.normal_impulse;
            point += 1;
        }
    }
    friction.friction[lane] = data.friction;
    friction.restitution[lane] = data.restitution;
    friction.has_restitution |= data.restitution > 0.0;
    if source.first && data.rolling_resistance > 0.0 {
        friction.rolling_resistance[lane] = data.rolling_resistance;
        friction.rolling_impulse.set(lane, data.rolling_impulse);
        friction.has_rolling = true;
    }
}

/// `n · M⁻¹ n` and the like for a direction: the response to a linear impulse.
#[inline(always)]
fn linear_response<const L: usize, const P: usize, const C: usize>(
    row: &NormalRow<L, P, C>,
    a: &WideVec3<L>,
    b: &WideVec3<L>,
) -> Wide<L> {
    (row.inverse_mass1.x + row.inverse_mass2.x) * (a.x * b.x)
        + (row.inverse_mass1.y + row.inverse_mass2.y) * (a.y * b.y)
        + (row.inverse_mass1.z + row.inverse_mass2.z) * (a.z * b.z)
}

/// Arms, gaps, effective masses and couplings of the points; returns the gaps, with empty points far apart.
#[inline(always)]
fn prepare_normals<const L: usize, const P: usize, const C: usize>(
    row: &mut NormalRow<L, P, C>,
    gathered: &Gathered<L, P>,
) -> [Wide<L>; P] {
    let n = row.normal;
    let linear = linear_response(row, &n, &n);
    let mut turned1 = [WideVec3::ZERO; P];
    let mut turned2 = [WideVec3::ZERO; P];
    let mut separations = [Wide::ZERO; P];
    for i in 0..P {
        let arm1 = gathered.r1[i].cross(&n);
        let arm2 = gathered.r2[i].cross(&n);
        let gap = gathered.apart[i].dot(&n);
        turned1[i] = row.inverse_inertia1.mul(&arm1);
        turned2[i] = row.inverse_inertia2.mul(&arm2);
        let response = linear + arm1.dot(&turned1[i]) + arm2.dot(&turned2[i]);
        separations[i] = gathered.present[i].if_positive(gap, Wide::splat(1e3));
        let point = &mut row.points[i];
        (point.arm1, point.arm2, point.separation) = (arm1, arm2, separations[i]);
        point.mass = gathered.present[i].if_positive(response.inverse_or_zero(), Wide::ZERO);
    }
    let mut pair = 0;
    for i in 0..P {
        for j in i + 1..P {
            row.coupling[pair] = linear + row.points[j].arm1.dot(&turned1[i]) + row.points[j].arm2.dot(&turned2[i]);
            pair += 1;
        }
    }
    separations
}

/// Friction centre, tangents and their response.
///
/// The centre is the mean of the points, where points that are apart fade out between one and two speculative distances: a
/// point that only might touch must not shift the friction.
#[inline(always)]
fn prepare_friction<const L: usize, const P: usize, const C: usize>(
    row: &NormalRow<L, P, C>,
    friction: &mut FrictionRow<L, P>,
    gathered: &Gathered<L, P>,
    separations: &[Wide<L>; P],
    speculative_distance: Real,
) {
    let (mut r1, mut r2, mut total) = (WideVec3::ZERO, WideVec3::ZERO, Wide::ZERO);
    let (two, one) = (Wide::splat(2.0), Wide::splat(1.0));
    let fade = Wide::splat(1.0 / crate::math::max(speculative_distance, 1e-12));
    for (i, &separation) in separations.iter().enumerate() {
        let weight = (two - separation * fade).min(one).max(Wide::splat(1e-6)) * gathered.present[i];
        r1 = r1.add_scaled(&gathered.r1[i], weight);
        r2 = r2.add_scaled(&gathered.r2[i], weight);
        total += weight;
    }
    let inverse = total.inverse_or_zero();
    let (r1, r2) = (r1.scale(inverse), r2.scale(inverse));
    for (i, &separation) in separations.iter().enumerate() {
        let away = gathered.r1[i] - r1;
        friction.levers[i] = away.dot(&away).sqrt() * gathered.present[i];
        let sideways = gathered.apart[i].sub_scaled(&row.normal, separation);
        friction.drift = friction.drift.max((sideways.dot(&sideways) * gathered.present[i]).sqrt());
    }
    let (t1, t2) = wide_tangents(&row.normal);
    (friction.tangent1, friction.tangent2) = (t1, t2);
    (friction.arm11, friction.arm21) = (r1.cross(&t1), r2.cross(&t1));
    (friction.arm12, friction.arm22) = (r1.cross(&t2), r2.cross(&t2));
    let turned11 = row.inverse_inertia1.mul(&friction.arm11);
    let turned21 = row.inverse_inertia2.mul(&friction.arm21);
    let turned12 = row.inverse_inertia1.mul(&friction.arm12);
    let turned22 = row.inverse_inertia2.mul(&friction.arm22);
    let k11 = linear_response(row, &t1, &t1) + friction.arm11.dot(&turned11) + friction.arm21.dot(&turned21);
    let k12 = linear_response(row, &t1, &t2) + friction.arm12.dot(&turned11) + friction.arm22.dot(&turned21);
    let k22 = linear_response(row, &t2, &t2) + friction.arm12.dot(&turned12) + friction.arm22.dot(&turned22);
    let inverse = (k11 * k22 - k12 * k12).inverse_or_zero();
    friction.mass11 = k22 * inverse;
    friction.mass12 = -(k12 * inverse);
    friction.mass22 = k11 * inverse;
    let twist = row.inverse_inertia1.add(&row.inverse_inertia2).mul(&row.normal).dot(&row.normal);
    friction.twist_mass = twist.inverse_or_zero();
}

/// [`crate::math::tangents`] in lanes.
#[inline(always)]
fn wide_tangents<const L: usize>(n: &WideVec3<L>) -> (WideVec3<L>, WideVec3<L>) {
    let sign = Wide(std::array::from_fn(|i| if n.z.0[i] >= 0.0 { 1.0 } else { -1.0 }));
    let a = -(Wide::splat(1.0) / (sign + n.z));
    let b = n.x * n.y * a;
    (
        WideVec3 { x: Wide::splat(1.0) + sign * n.x * n.x * a, y: sign * b, z: -(sign * n.x) },
        WideVec3 { x: b, y: sign + n.y * n.y * a, z: -n.y },
    )
}

/// The friction impulses of the last step, turned into this step's tangents, and the surface velocity.
#[inline(always)]
fn warm_friction<const L: usize, const P: usize>(
    friction: &mut FrictionRow<L, P>,
    lane: usize,
    source: &RowSource,
    context: &PrepareContext<'_>,
) {
    let data = &context.arbiters[source.arbiter as usize].data;
    let (mut tangential, mut twist) = (Vec3::ZERO, 0.0);
    for slot in 0..SLOTS {
        if source.slots >> slot & 1 == 1 {
            tangential += data.slots[slot].tangent_impulse;
            twist += data.slots[slot].twist_impulse;
        }
    }
    let (t1, t2) = (friction.tangent1.get(lane), friction.tangent2.get(lane));
    friction.impulse1[lane] = tangential.dot(t1);
    friction.impulse2[lane] = tangential.dot(t2);
    // One point has no lever and solves no twist: what an arbiter of more points has left of it must not act on.
    friction.twist_impulse[lane] = if P == 1 { 0.0 } else { twist };
    friction.target1[lane] = data.tangent_velocity.dot(t1);
    friction.target2[lane] = data.tangent_velocity.dot(t2);
}

/// Normal velocities with which the points would hit.
///
/// A point that is a gap `s` away at relative speed `u₀` and acceleration `a` along the normal hits at
/// `u² = u₀² − 2as`: without this, what is missing of a step's gravity would cost a bounce a few percent of its height.
#[inline(always)]
fn prepare_restitution<const L: usize, const P: usize, const C: usize>(
    row: &NormalRow<L, P, C>,
    friction: &mut FrictionRow<L, P>,
    bodies: &SolverBodies,
) {
    for lane in 0..L {
        let (b1, b2) = ((row.body1[lane] & !READ_ONLY) as usize, (row.body2[lane] & !READ_ONLY) as usize);
        let (s1, s2) = (&bodies.states[b1], &bodies.states[b2]);
        let n = row.normal.get(lane);
        let linear = n.dot(s2.linear_velocity - s1.linear_velocity);
        let acceleration = n.dot(bodies.motions[b2].acceleration - bodies.motions[b1].acceleration);
        for i in 0..P {
            let point = &row.points[i];
            let speed =
                linear + point.arm2.get(lane).dot(s2.angular_velocity) - point.arm1.get(lane).dot(s1.angular_velocity);
            let squared = speed * speed - 2.0 * acceleration * point.separation[lane];
            friction.approach[i][lane] =
                if speed < 0.0 && squared > 0.0 { -squared.sqrt() } else { crate::math::min(speed, 0.0) };
        }
    }
}

/// What a solved lane says of its arbiter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// All contacts are within the break distance.
    Holds,
    /// Some contact may be past it: ask [`crate::arbiter::ContactData::break_contacts`].
    MayBreak,
}

/// Writes impulses and gaps of one lane back to its arbiter.
#[inline(always)]
pub(crate) fn store_lane<const L: usize, const P: usize, const C: usize>(
    (row, friction): (&NormalRow<L, P, C>, &FrictionRow<L, P>),
    lane: usize,
    source: &RowSource,
    (arbiter, bodies): (&mut Arbiter, &SolverBodies),
    break_distance: Real,
) -> Outcome {
    let (s1, s2) = (
        &bodies.states[(row.body1[lane] & !READ_ONLY) as usize],
        &bodies.states[(row.body2[lane] & !READ_ONLY) as usize],
    );
    let n = row.normal.get(lane);
    let (t1, t2) = (friction.tangent1.get(lane), friction.tangent2.get(lane));
    let tangential = t1 * friction.impulse1[lane] + t2 * friction.impulse2[lane];
    let mut load = 0.0;
    for i in 0..P {
        load += row.impulses[i][lane];
    }
    // A quotient of the two: 1 / load is infinite for loads that are hardly numbers any more.
    let share = |impulse: Real| if load > 0.0 { impulse / load } else { 0.0 };
    let moved = s2.translation - s1.translation;
    let approach = n.dot(moved);
    let (mut point, mut reach, mut widest) = (0, 0.0, -Real::MAX);
    for slot in 0..SLOTS {
        if source.slots >> slot & 1 == 0 || point >= P {
            continue;
        }
        let (normal_point, contact) = (&row.points[point], &mut arbiter.data.slots[slot]);
        let impulse = row.impulses[point][lane];
        contact.normal = n;
        contact.normal_impulse = impulse;
        contact.total_impulse = friction.totals[point][lane];
        contact.tangent_impulse = tangential * share(impulse);
        contact.twist_impulse = friction.twist_impulse[lane] * share(impulse);
        let gap = normal_point.separation[lane] + approach + normal_point.arm2.get(lane).dot(s2.turn)
            - normal_point.arm1.get(lane).dot(s1.turn);
        contact.separation = gap;
        widest = crate::math::max(widest, gap);
        reach = crate::math::max(reach, friction.levers[point][lane]);
        point += 1;
    }
    if source.first {
        arbiter.data.rolling_impulse = friction.rolling_impulse.get(lane);
    }
    let slip = |t: Vec3, arm1: Vec3, arm2: Vec3| t.dot(moved) + arm2.dot(s2.turn) - arm1.dot(s1.turn);
    let slip1 = slip(t1, friction.arm11.get(lane), friction.arm21.get(lane));
    let slip2 = slip(t2, friction.arm12.get(lane), friction.arm22.get(lane));
    let turned = (s2.turn - s1.turn).length() * reach;
    // First order may be off by a tenth for the turns of one step; the exact test decides.
    let drift = friction.drift[lane] + 1.1 * ((slip1 * slip1 + slip2 * slip2).sqrt() + turned);
    if widest > 0.9 * break_distance || drift > break_distance { Outcome::MayBreak } else { Outcome::Holds }
}
