// Shadow rays per second by Embree 3, of what the example `rays` has written:
//     g++ -O3 examples/embree.cpp -lembree3 -o embree && ./embree rays.bin
// Rays go one by one (rtcOccluded1), shared out evenly among threads. Medians of seven runs; triangles have two sides and no holes.

#include <embree3/rtcore.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <thread>
#include <vector>

static double seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

int main(int words, char** word) {
    FILE* file = words > 1 ? fopen(word[1], "rb") : nullptr;
    uint32_t counts[2];
    if (!file || fread(counts, 4, 2, file) != 2) {
        fprintf(stderr, "embree: name the file that the example `rays` has written\n");
        return 1;
    }
    auto [triangles, number] = counts;
    std::vector<float> corners(size_t(triangles) * 9), given(size_t(number) * 7);
    if (fread(corners.data(), 4, corners.size(), file) != corners.size() || fread(given.data(), 4, given.size(), file) != given.size()) {
        fprintf(stderr, "embree: %s ends too early\n", word[1]);
        return 1;
    }

    RTCDevice device = rtcNewDevice(nullptr);
    double start = seconds();
    RTCScene scene = rtcNewScene(device);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* places = (float*)rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, size_t(triangles) * 3);
    std::copy(corners.begin(), corners.end(), places);
    auto* indices = (uint32_t*)rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles);
    for (uint32_t i = 0; i < 3 * triangles; i++) indices[i] = i;
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcCommitScene(scene);
    printf("Embree: BVH in %.3f s\n", seconds() - start);

    for (unsigned threads : {1u, std::max(1u, std::thread::hardware_concurrency())}) {
        std::vector<double> times;
        size_t lit = 0;
        for (int run = 0; run < 7; run++) {
            std::vector<RTCRay> rays(number);
            for (uint32_t i = 0; i < number; i++) {
                const float* r = &given[size_t(i) * 7];
                rays[i] = RTCRay{};
                rays[i].org_x = r[0], rays[i].org_y = r[1], rays[i].org_z = r[2];
                rays[i].dir_x = r[3], rays[i].dir_y = r[4], rays[i].dir_z = r[5];
                rays[i].tnear = 1e-3f, rays[i].tfar = r[6], rays[i].mask = ~0u;
            }
            start = seconds();
            std::vector<std::thread> all;
            for (unsigned k = 0; k < threads; k++)
                all.emplace_back([&, k] {
                    RTCIntersectContext context;
                    rtcInitIntersectContext(&context);
                    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
                    size_t end = size_t(number) * (k + 1) / threads;
                    for (size_t i = size_t(number) * k / threads; i < end; i++) rtcOccluded1(scene, &context, &rays[i]);
                });
            for (auto& thread : all) thread.join();
            times.push_back(seconds() - start);
            lit = std::count_if(rays.begin(), rays.end(), [](const RTCRay& r) { return r.tfar >= 0; });
        }
        std::sort(times.begin(), times.end());
        printf("Embree, %u threads: %.1f ms, %.2f million rays a second, %zu of %u lit\n", threads, times[3] * 1e3,
               number / times[3] / 1e6, lit, number);
    }
}
