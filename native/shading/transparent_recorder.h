// Records the transparent surfaces along a packet of shadow rays (tasks/transparent_surfaces.h).
#pragma once

#include "scene/view.h"
#include "simd/packet.h"
#include "tasks/transparent_surfaces.h"

namespace edgegrad::EDGEGRAD_ISA {

// Where the surfaces of a packet of rays are recorded.
struct TransparentRecord {
    TransparentMemory* memory = nullptr;  // null: nothing is recorded
    int32_t vertex = 0;
    RecordedRay ray = kRayToLight;
};

class TransparentRecorder {
 public:
    explicit TransparentRecorder(const TransparentRecord& of) : of_(of) {}

    // Starts a query.
    void start() {
        of_.memory->reserve<W>(room_);
        levels_ = most_ = 0;
        for (int lane = 0; lane < W; ++lane) count_[lane] = dark_[lane] = 0;
    }
    // TransparentClosure bits of a material: which derivatives its transmittance has.
    int32_t changes(const SceneView& scene, int32_t material) const {
        int32_t bits = 0;
        for (int32_t closure = scene.material_first_closure[material];
             closure < scene.material_first_closure[material + 1]; ++closure)
            bits |= of_.memory->closures[closure];
        return bits;
    }
    // Returns whether a ray continues behind an opaque surface. Only the first such surface has a derivative.
    bool goes_on(int lane, int32_t changes) { return changes & kEndsChange && dark_[lane]++ == 0; }
    // Allocation failures cannot be reported from an Embree callback, so memory is reserved before a query.
    void add(int lane, int32_t face, int32_t instance, float b1, float b2) {
        const int32_t level = count_[lane]++;
        if (level >= most_) most_ = level + 1;
        if (level >= room_) return;
        TransparentPacket<W>& p = packet(level);
        if (level == levels_) {
            p.vertex = of_.vertex, p.ray = of_.ray;
            for (int i = 0; i < W; ++i) p.face[i] = -1;
            ++levels_;
        }
        p.face[lane] = face, p.instance[lane] = instance;
        p.b1[lane] = b1, p.b2[lane] = b2;
    }
    // Returns whether the query must run again because it met more surfaces than there was room for.
    bool needs_room() {
        if (most_ <= room_) return false;
        room_ = most_;
        return true;
    }
    // Ends a query and keeps the surfaces of unoccluded rays.
    void keep(Mask open) {
        if (!any(open)) return;
        for (int32_t level = 0; level < levels_; ++level)
            for (int i = 0; i < W; ++i)
                if (!open[i]) packet(level).face[i] = -1;
        of_.memory->count += levels_;
    }

 private:
    TransparentPacket<W>& packet(int32_t level) const { return of_.memory->at<W>(of_.memory->count + level); }

    const TransparentRecord of_;
    int32_t room_ = 8;
    int32_t levels_ = 0, most_ = 0;  // number of packets begun; largest number of surfaces along a ray
    int32_t count_[W], dark_[W];
};

}  // namespace edgegrad::EDGEGRAD_ISA
