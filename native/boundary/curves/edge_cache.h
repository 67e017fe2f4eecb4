// What derivatives have found out about edges, kept for later calls: other views, seeds or numbers of samples
// of a scene in which nothing has moved.
#pragma once

#include <cstring>
#include <memory>
#include <mutex>
#include <tuple>
#include <utility>
#include <vector>

#include "scene/tables.h"
#include "scene/view.h"
#include "util/object_pool.h"

namespace edgegrad {

struct CandidateParts;
struct Candidates;
struct Intersections;
class EdgeTree;
class LightList;
struct SurfaceRegions;

// The last value that was made, with what it was made of.
template <typename Key, typename Value>
class Kept {
 public:
    // The value of `key`; make(): a new one.
    template <typename Make>
    std::shared_ptr<const Value> get(const Key& key, const Make& make) {
        const std::lock_guard<std::mutex> lock(lock_);
        if (!value_ || !(key_ == key)) {
            value_ = nullptr;  // unless all goes well nothing is kept
            Key made_of = key;
            value_ = std::make_shared<Value>(make());
            key_ = std::move(made_of);
        }
        return value_;
    }
    // Nothing is kept any more; what was.
    std::shared_ptr<Value> clear() {
        const std::lock_guard<std::mutex> lock(lock_);
        return std::move(value_);
    }

 private:
    std::mutex lock_;
    Key key_{};
    std::shared_ptr<Value> value_;
};

struct CameraKey {
    CameraView view;
    bool operator==(const CameraKey& other) const {
        return std::memcmp(&view, &other.view, sizeof view) == 0;
    }
};

struct EdgeCache {
    // From which side solid bodies are seen (boundary/meshes/solids.h) follows from the camera.
    using Sides = std::vector<int8_t>;
    // The camera moves; instances do; which meshes do.
    Kept<std::tuple<bool, bool, std::vector<uint8_t>>, Intersections> intersections;
    Kept<std::pair<CameraKey, RequestedMotion>, Candidates> primary;
    Kept<std::pair<std::shared_ptr<const LightList>, Sides>, Candidates> shadow;
    Kept<Sides, Candidates> silhouettes;  // towards the environment and other surfaces
    Kept<Sides, EdgeTree> tree;
    Kept<bool, SurfaceRegions> regions;
    Kept<bool, bool> cross;  // whether surfaces pass through each other or through lights
    // What candidates of the primary term are made in.
    ObjectPool<Candidates> spare_candidates;
    ObjectPool<CandidateParts> spare_parts;

    // Where vertices have changed.
    void clear() {
        intersections.clear();
        clear_values();
    }
    // Where values have: surfaces cross where they did.
    void clear_values() {
        spare_candidates.give(primary.clear());
        shadow.clear(), silhouettes.clear();
        tree.clear(), regions.clear(), cross.clear();
    }
};

}  // namespace edgegrad
