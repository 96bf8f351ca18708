//! Lanes against one pair at a time.

use super::{CuboidLanes, CuboidPair, Manifold, Near, WideManifold, cuboid_cuboid};
use crate::math::{Pose, Real, Rotation, Vec3};
use crate::random::Random;
use crate::shape::Cuboid;
use crate::simd::{Baseline, Instructions, Kernel, Lanes, Wide};
use std::marker::PhantomData;

/// Two boxes, where the second is, and the margin.
type Pair = (Cuboid, Cuboid, Pose, Real);

/// Boxes at random, and boxes stacked, leaning by a hair, crossed at 45°, edge on edge and corner past corner.
fn pair(random: &mut Random, round: usize) -> Pair {
    let half =
        |random: &mut Random| Vec3::new(random.between(0.1, 1.0), random.between(0.1, 1.0), random.between(0.1, 1.0));
    let (a, b) = (half(random), half(random));
    let quarter = 0.5_f32.sqrt();
    let eighth = Rotation::from_xyzw(0.0, 0.382_683_43, 0.0, 0.923_879_5);
    let lean = Rotation::from_xyzw(random.between(-2e-3, 2e-3), random.between(-2e-3, 2e-3), 0.0, 1.0).normalize();
    let sideways = Rotation::from_xyzw(0.382_683_43, 0.0, 0.0, 0.923_879_5);
    let above = Vec3::new(random.between(-0.5, 0.5), a.y + b.y + random.between(-0.1, 0.05), random.between(-0.5, 0.5));
    let (b, pose) = match round % 8 {
        0 => (b, Pose::from_position(above)),
        1 => (a, Pose::from_position(Vec3::new(0.0, 2.0 * a.y, 0.0))),
        2 => (b, Pose::new(above, lean)),
        3 => (b, Pose::new(above, eighth)),
        4 => (b, Pose::new(above, Rotation::from_xyzw(quarter, 0.0, 0.0, quarter))),
        5 => (b, Pose::new(Vec3::new(0.0, a.y + 1.3 * b.y.max(b.z), 0.1), eighth.mul(sideways))),
        6 => (b, Pose::from_position(a.with_z(0.0) + b.with_z(0.0) + Vec3::new(0.01, 0.02, random.between(-0.5, 0.5)))),
        _ => (b, Pose::new(random.vector() * 1.6, random.rotation())),
    };
    let (a, b) = (Cuboid::new(a).unwrap(), Cuboid::new(b).unwrap());
    (a, b, pose, if round.is_multiple_of(3) { 0.0 } else { 0.03 })
}

fn alone(&(a, b, pose, margin): &Pair) -> Manifold {
    let mut manifold = Manifold::EMPTY;
    cuboid_cuboid(&a, &b, &pose, margin, &mut manifold);
    manifold
}

/// What the engine does with a block: tests the axes of all, then finds the contacts of those that are not apart.
struct Together<'a, W, const L: usize> {
    pairs: &'a [Pair],
    found: &'a mut Vec<Manifold>,
    lanes: PhantomData<W>,
}

impl<W: Lanes<L>, const L: usize> Kernel for Together<'_, W, L> {
    #[inline(always)]
    fn run(self) {
        let mut near = Vec::new();
        for (chunk, pairs) in self.pairs.chunks(L).enumerate() {
            let mut cuboids = [CuboidPair::NONE; L];
            for (lane, (a, b, pose, margin)) in pairs.iter().enumerate() {
                cuboids[lane] = CuboidPair::new((a, b), pose, *margin);
            }
            let axes = CuboidLanes::<W>::load(&cuboids.each_ref()).test_axes();
            near.extend((0..pairs.len()).filter_map(|lane| Some((chunk * L + lane, cuboids[lane], axes.near(lane)?))));
        }
        let mut manifold = WideManifold::EMPTY;
        *self.found = vec![Manifold::EMPTY; self.pairs.len()];
        for chunk in near.chunks(L) {
            let (mut cuboids, mut told) = ([&CuboidPair::NONE; L], [&Near::NONE; L]);
            for (lane, (_, pair, near)) in chunk.iter().enumerate() {
                (cuboids[lane], told[lane]) = (pair, near);
            }
            CuboidLanes::<W>::load(&cuboids).contacts(&cuboids, &told, chunk.len(), &mut manifold);
            for (lane, (index, ..)) in chunk.iter().enumerate() {
                manifold.push_lane(lane, &mut self.found[*index]);
            }
        }
    }
}

fn together<W: Lanes<L>, const L: usize>(level: impl Instructions, pairs: &[Pair]) -> Vec<Manifold> {
    let mut found = Vec::new();
    level.run(Together::<W, L> { pairs, found: &mut found, lanes: PhantomData });
    found
}

/// By arrays of several lengths, and by the registers that this machine has.
fn by_all_lanes(pairs: &[Pair]) -> Vec<Vec<Manifold>> {
    let mut found = vec![
        together::<Wide<4>, 4>(Baseline, pairs),
        together::<Wide<8>, 8>(Baseline, pairs),
        together::<Wide<16>, 16>(Baseline, pairs),
    ];
    #[cfg(target_arch = "x86_64")]
    {
        use crate::simd::{Avx2, Avx2Lanes, Avx512, Avx512Lanes, Sse2Lanes};
        found.push(together::<Sse2Lanes, 4>(Baseline, pairs));
        found.extend(Avx2::detect().map(|level| together::<Avx2Lanes, 8>(level, pairs)));
        found.extend(Avx512::detect().map(|level| together::<Avx512Lanes, 16>(level, pairs)));
    }
    found
}

fn bits(manifold: &Manifold) -> Vec<[u32; 8]> {
    let bits = |p: &super::ManifoldPoint| {
        let (x, n) = (p.point1, p.normal);
        [x.x, x.y, x.z, n.x, n.y, n.z, p.separation].map(Real::to_bits).into_iter().chain([p.feature])
    };
    manifold.points().iter().map(|p| std::array::from_fn(|i| bits(p).nth(i).unwrap())).collect()
}

/// However many pairs stand side by side, each gets the bits that it gets alone.
#[test]
fn lanes_give_the_manifolds_of_one_pair_at_a_time_bit_for_bit() {
    let mut random = Random(0x0C0B_01D5_1DE5_1DE5);
    let pairs: Vec<Pair> = (0..16_000).map(|round| pair(&mut random, round)).collect();
    let wanted: Vec<_> = pairs.iter().map(|pair| bits(&alone(pair))).collect();
    for found in by_all_lanes(&pairs) {
        for (index, (found, wanted)) in found.iter().zip(&wanted).enumerate() {
            assert_eq!(bits(found), *wanted, "pair {index}: {:?}", pairs[index]);
        }
    }
    // All that the kernel knows has been asked for: nothing, four points, faces of either box, edges, passing corners.
    let features = || wanted.iter().flatten().map(|point| point[7]);
    assert!(wanted.iter().filter(|points| points.is_empty()).count() > 2_000);
    assert!(wanted.iter().filter(|points| points.len() == 4).count() > 2_000);
    for kind in [0x1000, 0x2000, 0x4000] {
        assert!(features().filter(|feature| feature & kind != 0).count() > 100, "{kind:#x}");
    }
}
