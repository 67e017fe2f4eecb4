// Records what a packet of rays passes (tasks/records/ray_records.h).
#pragma once

#include "simd/packet.h"
#include "tasks/records/media_on_rays.h"
#include "tasks/records/transparent_surfaces.h"

namespace edgegrad::EDGEGRAD_ISA {

// Where it is recorded what a packet of rays passes.
struct RayRecord {
    TransparentMemory* surfaces = nullptr;  // null: nothing of this kind is recorded
    MediaMemory* media = nullptr;
    int32_t vertex = 0;
    RecordedRay ray = kRayToLight;
};

// `Memory` is a RayRecords of packets `Packet`.
template <typename Memory, typename Packet>
class RayRecorder {
 public:
    RayRecorder(Memory* memory, const RayRecord& of) : memory_(memory), vertex_(of.vertex), ray_(of.ray) {}

    // Starts a query. Allocation failures cannot be reported from an Embree callback, so memory is reserved
    // before.
    void start() {
        memory_->template reserve<W>(room_);
        levels_ = most_ = 0;
        for (int lane = 0; lane < W; ++lane) count_[lane] = 0;
    }
    // Returns whether the query must run again because it met more than there was room for.
    bool needs_room() {
        if (most_ <= room_) return false;
        room_ = most_;
        return true;
    }
    // Ends a query and keeps the entries of these lanes.
    void keep(Mask lanes) {
        if (!any(lanes)) return;
        for (int32_t level = 0; level < levels_; ++level)
            for (int i = 0; i < W; ++i)
                if (!lanes[i]) packet(level).clear(i);
        memory_->count += levels_;
    }

 protected:
    // The packet of a lane's next entry; null: there is no room.
    Packet* next(int lane) {
        const int32_t level = count_[lane]++;
        if (level >= most_) most_ = level + 1;
        if (level >= room_) return nullptr;
        Packet& p = packet(level);
        if (level == levels_) {
            p.vertex = vertex_, p.ray = ray_;
            for (int i = 0; i < W; ++i) p.clear(i);
            ++levels_;
        }
        return &p;
    }
    // The number of a lane's entries for which there was room.
    int32_t kept(int lane) const { return count_[lane] < room_ ? count_[lane] : room_; }
    Packet& packet(int32_t level) const { return memory_->template at<W>(memory_->count + level); }
    const Memory& memory() const { return *memory_; }

 private:
    Memory* const memory_;
    const int32_t vertex_;
    const RecordedRay ray_;
    int32_t room_ = 8;
    int32_t levels_ = 0, most_ = 0;  // number of packets begun; largest number of entries of a ray
    int32_t count_[W];
};

}  // namespace edgegrad::EDGEGRAD_ISA
