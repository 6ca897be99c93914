#pragma once
/// The files of report/assets and the plotting library, embedded by cmake/embed.cmake.

#include <string_view>

namespace trihedron::report::assets {

extern const std::string_view kDocument;
extern const std::string_view kPage;
extern const std::string_view kHistory;
extern const std::string_view kCampaign;
extern const std::string_view kCampaignFigures;
extern const std::string_view kStyle;
extern const std::string_view kFigures;
extern const std::string_view kSphere;
extern const std::string_view kTrend;
extern const std::string_view kReport;
extern const std::string_view kPlotly;

}  // namespace trihedron::report::assets
