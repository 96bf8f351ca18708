//! The cache rules: how a registered point finds its slot, and when a cached contact breaks.
//!
//! *Slot free:* the nearest contact within the break distance is replaced and hands on its impulses, the tangential one turned
//! into the new plane; else the point takes the lowest empty slot.
//!
//! *Full:* for each of the four contacts, the area of the quadrilateral of the new point and the three others; the contact
//! whose removal leaves the largest area goes. Areas within a relative rounding error count as equal: then the lowest slot
//! goes, but never the deepest contact. The slot's impulses are handed on when the point is within the break distance of it.
//!
//! The area of four points in no given order is the largest of the three ways to pair them as diagonals,
//! `|d₁ × d₂| / 2`; halves and square roots cancel in the comparison.
//! Source of the scheme: Bullet's persistent manifold, by way of Jitter Physics.

use super::contact_data::{Contact, ContactData, HIDDEN, ONE_NORMAL, SLOTS};
use crate::math::{Pose, Real, Vec3};

/// Areas that differ by less than this share count as equal.
const AREA_TOLERANCE: Real = 1e-4;

/// Four times the squared area of the quadrilateral through four points in any order.
pub(crate) fn quadrilateral_area(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> Real {
    let pairings = [(a - b).cross(c - d), (a - c).cross(b - d), (a - d).cross(b - c)];
    pairings.iter().fold(0.0, |largest, cross| crate::math::max(cross.length_squared(), largest))
}

impl ContactData {
    /// Puts a registered contact where the cache rules want it.
    ///
    /// Distances are measured in the axes of body 1, where `local_anchor1` lives.
    pub(crate) fn add(&mut self, mut contact: Contact, break_distance: Real) {
        self.flags &= !(ONE_NORMAL | HIDDEN);
        let near = |old: &Contact| (old.local_anchor1 - contact.local_anchor1).length_squared();
        let limit = break_distance * break_distance;
        if self.usage_mask & 15 == 15 {
            let slot = self.slot_to_replace(&contact);
            if near(&self.slots[slot]) < limit {
                contact.inherit(&self.slots[slot]);
            }
            self.slots[slot] = contact;
            self.other_slots &= !(1 << slot);
            return;
        }
        let mut nearest: Option<(usize, Real)> = None;
        for (slot, old) in self.contacts() {
            let distance = near(old);
            if distance < limit && nearest.is_none_or(|(_, best)| distance < best) {
                nearest = Some((slot, distance));
            }
        }
        let slot = match nearest {
            Some((slot, _)) => {
                contact.inherit(&self.slots[slot]);
                slot
            }
            None => (!self.usage_mask).trailing_zeros() as usize,
        };
        self.slots[slot] = contact;
        self.usage_mask |= 1 << slot;
        self.other_slots &= !(1 << slot);
    }

    /// Which contact of a full cache makes room for `new`.
    fn slot_to_replace(&self, new: &Contact) -> usize {
        let p = new.local_anchor1;
        let a: [Vec3; SLOTS] = std::array::from_fn(|slot| self.slots[slot].local_anchor1);
        let areas = [
            quadrilateral_area(p, a[1], a[2], a[3]),
            quadrilateral_area(a[0], p, a[2], a[3]),
            quadrilateral_area(a[0], a[1], p, a[3]),
            quadrilateral_area(a[0], a[1], a[2], p),
        ];
        let largest = areas.iter().fold(0.0, |m, &area| crate::math::max(area, m));
        let ties = (0..SLOTS).filter(|&slot| areas[slot] >= largest * (1.0 - AREA_TOLERANCE));
        let deepest = self.deepest_slot();
        // With NaN-free input at least the largest itself ties; the deepest one goes only where nothing else does.
        let mut first = None;
        for slot in ties {
            if slot != deepest {
                return slot;
            }
            first = first.or(Some(slot));
        }
        first.unwrap_or(0)
    }

    /// The slot of the deepest of four contacts, the lowest on ties.
    fn deepest_slot(&self) -> usize {
        let mut deepest = 0;
        for slot in 1..SLOTS {
            if self.slots[slot].separation < self.slots[deepest].separation {
                deepest = slot;
            }
        }
        deepest
    }

    /// Refreshes the gaps for the bodies' new poses (at their centres of mass) and drops what is past the break distance,
    /// along the normal or across it.
    pub(crate) fn break_contacts(&mut self, pose1: &Pose, pose2: &Pose, break_distance: Real) {
        for slot in 0..SLOTS {
            if self.usage_mask >> slot & 1 == 0 {
                continue;
            }
            let contact = &mut self.slots[slot];
            let between = pose2.transform_point(contact.local_anchor2) - pose1.transform_point(contact.local_anchor1);
            let gap = between.dot(contact.normal);
            let drift = between - contact.normal * gap;
            contact.separation = gap;
            if gap > break_distance || drift.length_squared() > break_distance * break_distance {
                self.usage_mask &= !(1 << slot);
            }
        }
    }

    /// Starts a step: the solved bits (4 to 7) are set from the contacts that are about to be solved.
    pub(crate) fn mark_solved(&mut self) {
        self.usage_mask = self.usage_mask & 15 | (self.usage_mask & 15) << 4;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: Real, z: Real, separation: Real) -> Contact {
        Contact {
            local_anchor1: Vec3::new(x, 0.0, z),
            local_anchor2: Vec3::new(x, 0.0, z),
            normal: Vec3::Y,
            separation,
            ..Contact::default()
        }
    }

    fn full() -> ContactData {
        let mut data = ContactData::default();
        for (x, z) in [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)] {
            data.add(at(x, z, -0.1), 0.02);
        }
        data
    }

    #[test]
    fn a_near_point_replaces_and_inherits_with_the_tangent_turned_into_the_new_plane() {
        let mut data = ContactData::default();
        data.add(at(1.0, 0.0, 0.0), 0.02);
        data.slots[0].normal_impulse = 3.0;
        data.slots[0].tangent_impulse = Vec3::new(2.0, 0.0, 1.0);
        let tilted = Contact { normal: Vec3::new(0.6, 0.8, 0.0), ..at(1.01, 0.0, -0.001) };
        data.add(tilted, 0.02);
        assert_eq!(data.contact_count(), 1);
        let contact = data.contact(0).unwrap();
        assert_eq!((contact.normal_impulse, contact.normal), (3.0, tilted.normal));
        assert!(contact.tangent_impulse.dot(contact.normal).abs() < 1e-6);
        assert!((contact.tangent_impulse - Vec3::new(1.28, -0.96, 1.0)).length() < 1e-6);
    }

    #[test]
    fn a_far_point_takes_the_lowest_empty_slot() {
        let mut data = full();
        data.remove_contact(1).unwrap();
        data.add(at(5.0, 0.0, 0.0), 0.02);
        assert_eq!(data.contact(1).unwrap().local_anchor1.x, 5.0);
        assert_eq!(data.contact(1).unwrap().normal_impulse, 0.0);
    }

    #[test]
    fn a_full_cache_gives_up_the_point_whose_loss_leaves_the_largest_area() {
        let mut data = full();
        // Far out along slot 0's corner: leaving out slot 0 keeps the patch widest.
        data.add(at(3.0, 3.0, 0.0), 0.02);
        assert_eq!(data.contact(0).unwrap().local_anchor1.x, 3.0);
    }

    #[test]
    fn equal_areas_spare_the_deepest_and_take_the_lowest() {
        let mut data = full();
        // The centre gives the same area whichever corner goes.
        data.slots[0].separation = -0.5;
        data.add(at(0.0, 0.0, 0.0), 0.02);
        assert_eq!(data.contact(0).unwrap().separation, -0.5);
        assert_eq!(data.contact(1).unwrap().local_anchor1, Vec3::ZERO);
    }

    #[test]
    fn registering_a_corner_again_changes_nothing() {
        let mut data = full();
        let before: Vec<Vec3> = data.contacts().map(|(_, c)| c.local_anchor1).collect();
        data.add(at(1.0, -1.0, -0.1), 0.02);
        let after: Vec<Vec3> = data.contacts().map(|(_, c)| c.local_anchor1).collect();
        assert_eq!(before, after);
    }

    #[test]
    fn gap_and_drift_break_a_contact_each_at_the_break_distance() {
        let still = Pose::IDENTITY;
        for (offset, kept) in [(0.019, true), (0.021, false)] {
            for direction in [Vec3::Y, Vec3::X] {
                let mut data = ContactData::default();
                data.add(at(0.0, 0.0, 0.0), 0.02);
                data.break_contacts(&still, &Pose::from_position(direction * offset), 0.02);
                assert_eq!(data.contact_count() == 1, kept, "{direction} {offset}");
            }
        }
    }
}
