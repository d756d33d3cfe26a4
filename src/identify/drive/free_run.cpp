#include "identify/drive/free_run.hpp"

#include "core/aligned_vector.hpp"
#include "identify/drive/drive_search.hpp"

namespace torsio {
namespace {

std::vector<double> first_lane(const detail::AlignedVector<double>& lanes) {
  std::vector<double> values;
  values.reserve(lanes.size() / kDriveLanes);
  for (std::size_t n = 0; n < lanes.size(); n += kDriveLanes) values.push_back(lanes[n]);
  return values;
}

}  // namespace

FreeRun free_run(const DriveLog& log, const DriveRun& run, const DriveIdentification& identified) {
  detail::AlignedVector<double> angle(run.samples * kDriveLanes);
  detail::AlignedVector<double> joint(run.samples * kDriveLanes);
  detail::AlignedVector<double> torque(run.samples * kDriveLanes);
  roll_out(log, run, DriveLanes::all(identified.values), {identified.terms, identified.step_s},
           {angle.data(), joint.data(), torque.data()});
  return {first_lane(angle), first_lane(joint), first_lane(torque)};
}

FreeRun free_run(const DriveLog& log, const DriveIdentification& identified) {
  return free_run(log, run_from(log, 0, log.size()), identified);
}

}  // namespace torsio
